// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "flow_law.h"

namespace contact_flow {

/// Why the tangents of an arc are not handed out: all throw std::domain_error, with times.

/// The steps have become too short, or too many, at t [s].
[[noreturn]] void RefuseUnresolved(double t);
/// An entry of the Jacobian, which `dynamics` has just made at t [s], is no number.
[[noreturn]] void RefuseNoNumber(const ContactDynamics& dynamics, double t);
/// The error of a step from t [s] on is no number.
[[noreturn]] void RefuseNoError(double t);
/// Numbers overflowed.
[[noreturn]] void RefuseOverflow(const Arc& arc);
/// Where the tangents of the whole arc miss the flow law by more than errors of the state explain.
void JudgeFlowLaw(const Arc& arc, const FlowLaw& law);

}  // namespace contact_flow
