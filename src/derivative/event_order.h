// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// How the instant of a transition changes with the state before it, −Dg/ġ of the guard g of its
/// first event [2d]; 0 where it has none.
Eigen::RowVectorXd InstantGradient(ContactDynamics* dynamics, const Transition& transition);

/// What is known of errors e [2d+k] before a transition: contacts of J⁻ have gaps and rates that
/// are 0 in truth, and can be looked at in the run. The errors are moved onto
///   Da_J e_q = a_J,   D(Da_J v) e_q + Da_J e_v = Da_J v
/// by the shortest way in the kinetic metric.
void KeepContacts(const MechanicalSystem& system, const Transition& transition,
                  const std::vector<Vector*>& errors);

/// Not kOk where errors of the state shift one transition against the next by as much as they are
/// apart: the order in which the run found them may be another, and so the derivative. `first` and
/// `second` are the shifts of both by the same samples of the error [s].
Status CheckOrder(const MechanicalSystem& system, const Transition& before, const Transition& after,
                  const std::vector<double>& first, const std::vector<double>& second);

}  // namespace contact_flow
