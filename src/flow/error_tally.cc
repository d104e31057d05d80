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

void ErrorTally::AddEvent(double time_error, const VectorRef& jump) {
  error_.head(space_->dof()) += time_error * jump.cwiseAbs();
}

}  // namespace contact_flow
