// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/dense_step.h"

#include <algorithm>

namespace contact_flow {

void EvaluateDenseStep(const double* c, int n, double theta, double* x) {
  const double rest = 1 - theta;
  for (int i = 0; i < n; ++i) {
    double value = c[7 * n + i] * theta;
    value = (value + c[6 * n + i]) * rest;
    value = (value + c[5 * n + i]) * theta;
    value = (value + c[4 * n + i]) * rest;
    value = (value + c[3 * n + i]) * theta;
    value = (value + c[2 * n + i]) * rest;
    value = (value + c[n + i]) * theta;
    x[i] = value + c[i];
  }
}

DenseArc DenseArc::Between(double begin, double end) const {
  DenseArc part;
  for (std::size_t k = StepAt(begin); k < begin_.size(); ++k) {
    if (!part.Empty() && !(begin_[k] < end)) break;
    part.Append(begin_[k], length_[k], coefficients_.data() + k * kDenseOrder * n_, n_);
  }
  return part;
}

std::size_t DenseArc::StepAt(double t) const {
  const auto after = std::upper_bound(begin_.begin(), begin_.end(), t);
  return after == begin_.begin() ? 0 : static_cast<std::size_t>(after - begin_.begin() - 1);
}

void DenseArc::Append(double t, double h, const double* c, int n) {
  n_ = n;
  begin_.push_back(t);
  length_.push_back(h);
  coefficients_.insert(coefficients_.end(), c, c + kDenseOrder * n);
}

void DenseArc::DropBefore(double t) {
  std::size_t count = 0;
  while (count < begin_.size() && begin_[count] + length_[count] <= t) ++count;
  const auto drop = [](std::vector<double>* from, std::size_t n) {
    from->erase(from->begin(), from->begin() + static_cast<std::ptrdiff_t>(n));
  };
  drop(&begin_, count);
  drop(&length_, count);
  drop(&coefficients_, count * kDenseOrder * static_cast<std::size_t>(n_));
}

void DenseArc::Evaluate(double t, double* x) const {
  if (Empty()) return;  // an event at the begin of the arc: x is left as it is
  const std::size_t k = StepAt(t);
  const double theta = std::clamp((t - begin_[k]) / length_[k], 0.0, 1.0);
  EvaluateDenseStep(coefficients_.data() + k * kDenseOrder * n_, n_, theta, x);
}

}  // namespace contact_flow
