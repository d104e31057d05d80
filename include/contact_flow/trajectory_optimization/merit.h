// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/trajectory_optimization/problem.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The augmented Lagrangian of a problem's conditions l ≤ c ≤ u,
///   L = J + Σ_i (ρ_i r_i² − λ_i²/ρ_i) / 2,   r = c + λ/ρ − clamp(c + λ/ρ, l, u),
/// whose minima over y are those of J under the conditions once λ is right: ρ r is the better λ.
/// L is a sum of squares beside J, so that steps of Gauss and Newton stay what they are.
struct Multipliers {
  Vector lambda;  ///< λ, dJ by the condition's unit [conditions]; empty: J alone
  Vector rho;     ///< ρ > 0 [conditions]

  /// r_i of condition i with the value c.
  double Residual(const TrajectoryCondition& condition, Eigen::Index i, double c) const;
  /// ½ Σ (ρ r² − λ²/ρ).
  double Penalty(const std::vector<TrajectoryCondition>& conditions, const Vector& values) const;
  /// |r − λ/ρ|: how far conditions are missed, and those that do not hold back have a λ yet.
  Vector Gaps(const std::vector<TrajectoryCondition>& conditions, const Vector& values) const;
  /// λ ← ρ r.
  void Update(const std::vector<TrajectoryCondition>& conditions, const Vector& values);
};

/// c of each condition in a run with these States; NaN where a touchdown does not happen.
Vector ConditionValues(const Unknowns& unknowns, const Trajectory& run, const Matrix& states);

/// By how much c misses its bounds [conditions], ≥ 0.
Vector Violations(const std::vector<TrajectoryCondition>& conditions, const Vector& values);

}  // namespace contact_flow
