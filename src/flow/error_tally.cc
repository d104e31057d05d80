// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/error_tally.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

constexpr double kUnitRounding = std::numeric_limits<double>::epsilon();

}  // namespace

void ErrorTally::AddStep(const Stepper& stepper) {
  const int d = space_->dof(), nq = space_->num_positions();
  const double h = stepper.step();
  const auto own = stepper.LocalErrors() + kUnitRounding * stepper.end().array().abs();  // [nq+d]
  error_.head(d) += h * error_.tail(d);
  if (space_->IsFlat()) {
    error_.array() += own;
    return;
  }
  error_.tail(d).array() += own.tail(d);
  const std::vector<int>& velocity_of = space_->line_velocities();
  for (int k = 0; k < nq; ++k) {
    if (velocity_of[k] >= 0) error_(velocity_of[k]) += own(k);
  }
  for (const ConfigurationSpace::Rotation& rotation : space_->rotations()) {
    double largest = 0;  // |η| ≤ 2 |δa| for a quaternion a
    for (int k = 0; k < 4; ++k) largest = std::max(largest, own(rotation.q + k));
    for (int k = 0; k < 3; ++k) error_(rotation.v + k) += 2 * largest;
  }
}

void ErrorTally::AddImpact(const Matrix& rows, const Vector& rates, const VectorRef& jump) {
  const int d = space_->dof();
  if (rates.size() == 1) {
    const Vector before = error_.head(d);
    const auto saltation = [&](int i, int j) { return (i == j) + jump(i) * rows(0, j) / rates(0); };
    for (int i = 0; i < d; ++i) {
      error_(i) = 0;
      for (int j = 0; j < d; ++j) error_(i) += std::abs(saltation(i, j)) * before(j);
    }
    return;
  }
  // What a contact adds to the jump goes with its rate, and so does what its delay takes from it:
  // the largest gap error over the largest rate.
  const double late = (rows.cwiseAbs() * error_.head(d)).maxCoeff() / rates.cwiseAbs().maxCoeff();
  error_.head(d) += late * jump.cwiseAbs();
}

}  // namespace contact_flow
