// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/dop853.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dop853_tableau.h"

namespace contact_flow {

using dop853::kA;
using dop853::kStages;

namespace {

/// Σ_k kA[J][k] stage_k[i] over the nonzero weights only, decided at compile time.
template <int J, int K>
inline double WeightedSum(const double* __restrict stages, int n, int i) {
  if constexpr (K < 0) {
    return 0;
  } else if constexpr (kA[J][K] == 0) {
    return WeightedSum<J, K - 1>(stages, n, i);
  } else {
    return WeightedSum<J, K - 1>(stages, n, i) + kA[J][K] * stages[K * n + i];
  }
}

/// Σ_k h kDense[R][k] stage_k[i], likewise.
template <int R, int K>
inline double DenseSum(double h, const double* __restrict stages, int n, int i) {
  if constexpr (K < 0) {
    return 0;
  } else if constexpr (dop853::kDense[R][K] == 0) {
    return DenseSum<R, K - 1>(h, stages, n, i);
  } else {
    return DenseSum<R, K - 1>(h, stages, n, i) + h * dop853::kDense[R][K] * stages[K * n + i];
  }
}

template <int R>
void WriteDenseRow(double h, const double* __restrict stages, int n, double* __restrict row) {
  for (int i = 0; i < n; ++i) row[i] = DenseSum<R, dop853::kAllStages - 1>(h, stages, n, i);
}

}  // namespace

Dop853::Dop853(int n, Field field)
    : Stepper(n, -1.0 / 8, StagePlaces::OfDop853()),
      field_(std::move(field)),
      scratch_(n),
      stages_(dop853::kAllStages * n) {
  begin_field_ = stage(0);
  end_field_ = stage(kStages);
}

template <int J>
void Dop853::Combine(double* __restrict out) const {
  const double* __restrict x = x_.data();
  const double* __restrict stages = stages_.data();
  for (int i = 0; i < n_; ++i) out[i] = x[i] + h_ * WeightedSum<J, J - 1>(stages, n_, i);
}

template <int J>
void Dop853::EvaluateStage() {
  Combine<J>(scratch_.data());
  field_(scratch_.data(), stage(J));
}

void Dop853::Begin(const Vector& x) {
  x_ = x;
  field_(x_.data(), stage(0));
}

double Dop853::GuessStep(double relative_tolerance, double absolute_tolerance) {
  const auto f0 = begin_field();
  double d0 = 0, d1 = 0;
  for (int i = 0; i < n_; ++i) {
    const double scale = absolute_tolerance + relative_tolerance * std::abs(x_(i));
    d0 += (x_(i) / scale) * (x_(i) / scale);
    d1 += (f0(i) / scale) * (f0(i) / scale);
  }
  // A state far below the tolerance says nothing about the scale of the motion.
  const double h0 = d0 < 1e-10 || d1 < 1e-10 ? 1e-6 : std::max(1e-6, 0.01 * std::sqrt(d0 / d1));
  scratch_ = x_ + h0 * f0;
  field_(scratch_.data(), stage(1));
  double d2 = 0;
  for (int i = 0; i < n_; ++i) {
    const double scale = absolute_tolerance + relative_tolerance * std::abs(x_(i));
    const double change = (stage(1)[i] - f0(i)) / scale;
    d2 += change * change;
  }
  const double curvature = std::max(std::sqrt(d1), std::sqrt(d2) / h0);
  const double h1 =
      curvature <= 1e-15 ? std::max(1e-6, h0 * 1e-3) : std::pow(0.01 / curvature, 1.0 / 8);
  return std::min(100 * h0, h1);
}

double Dop853::TryStep(double h, double relative_tolerance, double absolute_tolerance) {
  h_ = h;
  extended_ = false;
  EvaluateStage<1>();
  EvaluateStage<2>();
  EvaluateStage<3>();
  EvaluateStage<4>();
  EvaluateStage<5>();
  EvaluateStage<6>();
  EvaluateStage<7>();
  EvaluateStage<8>();
  EvaluateStage<9>();
  EvaluateStage<10>();
  EvaluateStage<11>();
  Combine<12>(x_end_.data());
  double error5 = 0, error3 = 0;
  for (int i = 0; i < n_; ++i) {
    double e5 = 0, e3 = 0;
    for (int k : {0, 5, 6, 7, 8, 9, 10, 11}) {
      e5 += dop853::kError5[k] * stages_(k * n_ + i);
      e3 += (kA[kStages][k] - dop853::kError3Minus[k]) * stages_(k * n_ + i);
    }
    const double scale =
        absolute_tolerance + relative_tolerance * std::max(std::abs(x_(i)), std::abs(x_end_(i)));
    errors_(i) = e5;
    error5 += (e5 / scale) * (e5 / scale);
    error3 += (e3 / scale) * (e3 / scale);
  }
  error_factor_ = 0;
  if (error5 == 0) return 0;
  error_factor_ = std::abs(h) * std::sqrt(error5 / (error5 + 0.01 * error3));
  return std::abs(h) * error5 / std::sqrt(n_ * (error5 + 0.01 * error3));
}

void Dop853::Finish() {
  field_(x_end_.data(), stage(12));
  if (!watches_) return;
  // Stage 11 lies at the end of the step, too; scratch_ still is its argument.
  const double change = (end_field() - Eigen::Map<const Vector>(stage(11), n_)).norm();
  const double distance = (x_end_ - scratch_).norm();
  stiffness_ = distance > 0 ? std::abs(h_) * change / distance : 0;
}

void Dop853::Extend() {
  EvaluateStage<13>();
  EvaluateStage<14>();
  EvaluateStage<15>();
  double* __restrict c = dense_.data();
  for (int i = 0; i < n_; ++i) {
    const double change = x_end_(i) - x_(i);
    const double bend = h_ * stages_(i) - change;
    c[i] = x_(i);
    c[n_ + i] = change;
    c[2 * n_ + i] = bend;
    c[3 * n_ + i] = change - h_ * stages_(12 * n_ + i) - bend;
  }
  WriteDenseRow<0>(h_, stages_.data(), n_, c + 4 * n_);
  WriteDenseRow<1>(h_, stages_.data(), n_, c + 5 * n_);
  WriteDenseRow<2>(h_, stages_.data(), n_, c + 6 * n_);
  WriteDenseRow<3>(h_, stages_.data(), n_, c + 7 * n_);
  extended_ = true;
}

void Dop853::Advance() {
  x_.swap(x_end_);
  std::copy(stage(12), stage(12) + n_, stage(0));
}

}  // namespace contact_flow
