// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "propagation_errors.h"

namespace contact_flow {

/// What errors of the state along an arc change in its propagator [2d × 2d+k], e_l [2d] being the
/// error at the end of part l. In each part velocities change by
///   ∫ D²F[e, Φ w] dt ≈ Σ_j T_j D²F_j e (I + Φ) / 2,
/// and positions by what is left of the part times that; D²F is taken in the middle of pieces T_j
/// of equally many steps of the run: where a force is felt over a part of the way alone, the steps
/// tell. Parts behind carry it on by their propagators.
///
/// Where a contact slips in space at the speed s, what turns s decays at a rate of about μλ/(m s):
/// where that is fast beside T_j, errors, tangents and what they change there are smaller by it.
Matrix PropagatorChange(ContactDynamics* dynamics, const Arc& arc,
                        const std::vector<ArcPart>& parts, const std::vector<Vector>& e);

}  // namespace contact_flow
