// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/corner_functions.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Limits of efforts that a perturbed run meets where the run does not, or the other way round: the
/// share r of an effort in its limit (EffortLimits) is looked at where it turns, and at both ends
/// of every arc. r by x and u, along the arc; what parameters change in r itself is not looked at.
class EffortWatches {
 public:
  EffortWatches(const MechanicalSystem& system, const Trajectory& trajectory,
                const BDerivative& derivative);

  /// Those of arc k, but its end, for the tangent at its begin, which moves by `shift` [s].
  void ConsiderArc(std::size_t k, const Vector& w, double shift, ValidityRadius* smallest) const;
  /// That at the end of arc k, for the tangent there.
  void ConsiderEnd(std::size_t k, const Vector& w, double shift, ValidityRadius* smallest) const;

 private:
  /// A share at a place of an arc, and how it moves with a tangent, at the begin of the arc or for
  /// `ends` at its end, and with the instant.
  struct Watch {
    int effort;
    double t, value, rate;        // [s], [1], [1/s]
    Eigen::RowVectorXd gradient;  // [1 × 2d+k]
  };
  void WatchTurns(std::size_t k);
  std::vector<Watch> At(std::size_t k, double t) const;
  void Consider(const Watch& watch, const Vector& w, double shift, ValidityRadius* smallest) const;

  const MechanicalSystem& system_;
  const Trajectory& trajectory_;
  const BDerivative& derivative_;
  const CornerFunctions functions_;
  std::vector<std::vector<Watch>> begins_, turns_, ends_;  // of each arc
};

}  // namespace contact_flow
