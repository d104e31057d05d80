// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/flow/trajectory.h"
#include "test/adversary/generator.h"
#include "test/adversary/reference_flow.h"

namespace contact_flow {
namespace adversary {

/// The bits of a reference's set, in the places in which the library sees its constraints.
unsigned long PlaceBits(const Case& c, ConstraintSet set);

/// The events of a run, each as " instant:+activated:before>after" with sets as bits; instants in
/// units of order 1.
std::string Events(const Case& c, const Trajectory& run);
std::string Events(const Case& c, const ReferenceRun& run);

}  // namespace adversary
}  // namespace contact_flow
