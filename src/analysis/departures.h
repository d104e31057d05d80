// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What keeps a contact that touches where an arc begins, and is not of its mode, from being held
/// there: it is positive.
struct Departure {
  int constraint;
  double value;  ///< the acceleration with which it leaves, or the pull that would hold it
  double rate;   ///< along the arc
  Eigen::RowVectorXd gradient;  ///< [2d+k]
};

/// Those of arc `k`: where the input changes, or behind an impact, new forces lift contacts that
/// were pressed. Where a force has just passed zero by itself nothing lifts it yet, and the rate of
/// that is looked at elsewhere. A contact that never slips is held as long as it need not be
/// pulled: the first of its two margins counts.
std::vector<Departure> FindDepartures(ContactDynamics* dynamics, const Trajectory& trajectory,
                                      const BDerivative& derivative, std::size_t k);

}  // namespace contact_flow
