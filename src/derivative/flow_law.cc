// SPDX-License-Identifier: BSD-3-Clause
#include "flow_law.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

/// The residual is compared with this many times the tolerance and the state's error: the state's
/// local errors add up along a step.
constexpr double kAllowed = 10;
/// A field below this part of what it is the sum of is rounding: rest.
constexpr double kRest = 1e-9;
/// Rounding of F, relative to these terms: no residual.
constexpr double kRounding = 1e-14;

}  // namespace

void FlowLaw::Begin(const VectorRef& field, double terms) {
  size_ = std::max({field.lpNorm<1>(), kRest * terms, std::numeric_limits<double>::min()});
  rounding_ = kRounding * std::max(terms, size_);
}

double FlowLaw::Residual(const Matrix& step, const VectorRef& before, const VectorRef& after,
                         double size) {
  const Eigen::Index n = after.size();
  difference_ = -after;
  difference_.noalias() += step.topLeftCorner(n, n).lazyProduct(before);
  return Note(size);
}

double FlowLaw::Residual(const VectorRef& carried, const VectorRef& after, double size) {
  difference_ = carried - after;
  return Note(size);
}

double FlowLaw::Note(double size) {
  const double left = difference_.cwiseAbs().maxCoeff() / size;
  last_ = left <= rounding_ ? 0 : left / size_;  // NaN is one
  per_noise_ = 1 / (size * size_);
  return last_;
}

Vector FlowLaw::Defect() const {
  const double explained = kAllowed * tolerance_ * per_noise_;
  if (last_ <= explained) return Vector::Zero(difference_.size());
  return (1 - explained / last_) * difference_;
}

bool FlowLaw::Holds(const MatrixRef& jacobian, double state) {
  double largest = 1;
  for (Eigen::Index r = 0; r < jacobian.rows(); ++r) {
    largest = std::max(largest, jacobian.row(r).cwiseAbs().sum());
  }
  per_noise_ *= largest * state;
  return last_ <= kAllowed * (tolerance_ + noise_ * per_noise_);
}

void FlowLaw::Excuse() { noise_ = std::max(noise_, last_ / per_noise_); }

}  // namespace contact_flow
