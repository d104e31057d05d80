// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/merit.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {

double Multipliers::Residual(const TrajectoryCondition& condition, Eigen::Index i, double c) const {
  const double shifted = c + lambda(i) / rho(i);
  return shifted - std::min(std::max(shifted, condition.lower), condition.upper);
}

double Multipliers::Penalty(const std::vector<TrajectoryCondition>& conditions,
                            const Vector& values) const {
  double sum = 0;
  for (Eigen::Index i = 0; i < rho.size(); ++i) {
    const double r = Residual(conditions[static_cast<std::size_t>(i)], i, values(i));
    sum += (rho(i) * r * r - lambda(i) * lambda(i) / rho(i)) / 2;
  }
  return sum;
}

Vector Multipliers::Gaps(const std::vector<TrajectoryCondition>& conditions,
                         const Vector& values) const {
  Vector gaps(rho.size());
  for (Eigen::Index i = 0; i < rho.size(); ++i) {
    const double r = Residual(conditions[static_cast<std::size_t>(i)], i, values(i));
    gaps(i) = std::abs(r - lambda(i) / rho(i));
  }
  return gaps;
}

void Multipliers::Update(const std::vector<TrajectoryCondition>& conditions, const Vector& values) {
  for (Eigen::Index i = 0; i < rho.size(); ++i) {
    lambda(i) = rho(i) * Residual(conditions[static_cast<std::size_t>(i)], i, values(i));
  }
}

Vector ConditionValues(const Unknowns& unknowns, const Trajectory& run, const Matrix& states) {
  const std::vector<TrajectoryCondition>& conditions = unknowns.problem().conditions;
  Vector values(static_cast<Eigen::Index>(conditions.size()));
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const TrajectoryCondition& condition = conditions[i];
    values(static_cast<Eigen::Index>(i)) = condition.kind == TrajectoryCondition::Kind::kState
                                               ? states(condition.index, condition.number - 1)
                                               : TimeOf(run, {condition.index, condition.number});
  }
  return values;
}

Vector Violations(const std::vector<TrajectoryCondition>& conditions, const Vector& values) {
  Vector off(values.size());
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const TrajectoryCondition& condition = conditions[static_cast<std::size_t>(i)];
    off(i) = std::max({condition.lower - values(i), values(i) - condition.upper, 0.0});
  }
  return off;
}

}  // namespace contact_flow
