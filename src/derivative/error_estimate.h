// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "propagation_errors.h"
#include "run_preparation.h"

namespace contact_flow {

/// Fills the derivative's part_errors and the errors in its Trust. `dynamics` is scratch with the
/// input of each arc, `propagation` the errors of the propagators as they are computed, both from
/// the first arc of the derivative on.
///
/// The errors of the state at the end of arc k are carried on by the derivative itself,
///   e ← Φ_k (e + s ε_k) + s' ε_k,   e ← Ξ_k e,
/// with ε_k from Arc::error, less by the order that the integrator goes on with beyond its
/// estimate, and a selection Ξ_k of each event, for a few vectors of signs s, whose mean square
/// counts: a sum of independent errors without a matrix product. They make the factors of the
/// derivative wrong, too: a propagator by D²F e in the middle of each of its parts; a reset by the
/// change of the speed of approach. Where they leave the order of two events unknown, the
/// derivative's status says so (CheckOrder). A matrix product and two Jacobians an arc.
void EstimateErrors(const Trajectory& trajectory, std::size_t first,
                    const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                    const std::vector<PropagationErrors>& propagation, BDerivative* derivative);

/// The same of a whole run whose arcs are products: the estimated error of x(T) alone [2d],
/// and CheckOrder.
Status CheckOrders(const Trajectory& trajectory,
                   const std::vector<std::shared_ptr<ContactDynamics>>& dynamics,
                   const BDerivative& derivative, const ArcProduct& carry, Vector* state_error);

}  // namespace contact_flow
