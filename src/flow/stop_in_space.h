// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The contacts whose slip in space ends with that of `trigger`: those that are as slow. `terms`
/// and `acceleration` are those at the end; an end that takes its time becomes the transition's
/// obstacle, for tangents are not resolved there.
ConstraintSet StoppedTogether(const MechanicalSystem& system, const ConstraintTerms& terms,
                              const Vector& acceleration, int trigger, Transition* transition);

}  // namespace contact_flow
