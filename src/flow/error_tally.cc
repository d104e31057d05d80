// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/error_tally.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

constexpr double kRounding = std::numeric_limits<double>::epsilon();

double StepError(const Dop853& stepper, int i) {
  return stepper.LocalError(i) + kRounding * std::abs(stepper.end()(i));
}

}  // namespace

void ErrorTally::AddStep(const Dop853& stepper) {
  const int d = space_->dof(), nq = space_->num_positions();
  const double h = stepper.step();
  error_.head(d) += h * error_.tail(d);
  for (int i = 0; i < d; ++i) error_(d + i) += StepError(stepper, nq + i);
  if (space_->IsFlat()) {
    for (int i = 0; i < d; ++i) error_(i) += StepError(stepper, i);
    return;
  }
  const std::vector<int>& velocity_of = space_->line_velocities();
  for (int k = 0; k < nq; ++k) {
    if (velocity_of[k] >= 0) error_(velocity_of[k]) += StepError(stepper, k);
  }
  for (const ConfigurationSpace::Rotation& rotation : space_->rotations()) {
    double largest = 0;  // |η| ≤ 2 |δa| for a quaternion a
    for (int k = 0; k < 4; ++k) largest = std::max(largest, StepError(stepper, rotation.q + k));
    for (int k = 0; k < 3; ++k) error_(rotation.v + k) += 2 * largest;
  }
}

void ErrorTally::AddImpact(const Matrix& rows, const Vector& rates, const VectorRef& jump) {
  const int d = space_->dof();
  if (rates.size() == 1) {
    const Vector before = error_.head(d);
    const Eigen::RowVectorXd row = rows.row(0) / rates(0);
    for (int i = 0; i < d; ++i) {
      Eigen::RowVectorXd saltation = jump(i) * row;
      saltation(i) += 1;
      error_(i) = saltation.cwiseAbs().dot(before);
    }
    return;
  }
  double late = 0;
  for (Eigen::Index k = 0; k < rates.size(); ++k) {
    late = std::max(late, rows.row(k).cwiseAbs().dot(error_.head(d)) / std::abs(rates(k)));
  }
  error_.head(d) += late * jump.cwiseAbs();
}

}  // namespace contact_flow
