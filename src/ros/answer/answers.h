// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/ComparisonRequest.h"
#include "contact_flow/ContactTrajectory.h"
#include "contact_flow/DerivativeComparison.h"
#include "contact_flow/DerivativeRequest.h"
#include "contact_flow/OutcomeDerivative.h"
#include "contact_flow/SimulationRequest.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The answers of the node, as functions of setup and request alone: no clock, no state, headers
/// left empty. The same request gives the same bits, which is what verify_bag relies on. Throw
/// std::invalid_argument, std::out_of_range or std::length_error for a request that
/// is not in order.
ContactTrajectory Answer(const Setup& setup, const SimulationRequest& request);
OutcomeDerivative Answer(const Setup& setup, const DerivativeRequest& request);
DerivativeComparison Answer(const Setup& setup, const ComparisonRequest& request);

}  // namespace ros_interface
}  // namespace contact_flow
