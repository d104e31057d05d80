// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "test/adversary/trial.h"

namespace contact_flow {
namespace adversary {

/// A gust, or a bump of the ground, that is shorter than the steps of a run is found with
/// `max_step` alone, as documented (docs/architecture.md): a run and its derivative may miss it.
/// Whether that is so: a run with `max_step` a thousandth of the duration comes to the state x of
/// the reference, of which the usual run is off by `off`; or ends.
bool FoundWithMaxStep(const Case& c, const Trial& trial, const Vector& x, double off);

/// The same of its derivative along w, beside the reference's quotient.
bool FoundWithMaxStep(const Case& c, const Trial& trial, const Vector& w, const Vector& quotient,
                      double off);

}  // namespace adversary
}  // namespace contact_flow
