// SPDX-License-Identifier: BSD-3-Clause
#include "matrix_inequalities.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "log_barrier.h"

namespace contact_flow {
namespace {

constexpr int kMaxCentres = 100, kMaxNewton = 40;
constexpr double kAbove = 1.1;    // ρ at the start, of the rate
constexpr double kCentred = 0.3;  // Newton decrement at which ρ may be lowered
constexpr double kTowards = 0.1;  // ρ ← (1 − θ) rate + θ ρ
constexpr double kSlow = 1e-4;    // relative gain per centre at which to stop
constexpr double kDamping = 1e-8;

/// Adds −log det S(y); false where S(y) is not positive definite.
bool Add(const AffineMatrix& S, const Vector& y, LogBarrier* barrier) {
  const Eigen::Index size = S.constant.rows();
  Matrix value = S.constant;
  for (Eigen::Index k = 0; k < y.size(); ++k) value += y(k) * S.slopes[k];
  const Eigen::LLT<Matrix> factor(value);
  if (factor.info() != Eigen::Success) return false;
  const Matrix root = factor.matrixL().solve(Matrix::Identity(size, size));  // R, R S Rᵀ = I
  Matrix directions(size * size, y.size());
  for (Eigen::Index k = 0; k < y.size(); ++k) {
    AskBudget();
    Eigen::Map<Matrix>(directions.col(k).data(), size, size) =
        root * S.slopes[k] * root.transpose();
  }
  barrier->Add(directions);
  return true;
}

/// Newton's method for the analytic centre; false where it fails.
bool Centre(const RateProblem& problem, const std::vector<AffineMatrix>& inequalities, Vector* y) {
  Eigen::Index largest = 0;
  for (const AffineMatrix& S : inequalities) largest = std::max(largest, S.constant.rows());
  for (int k = 0; k < kMaxNewton; ++k) {
    if (problem.cancelled && problem.cancelled()) return false;
    LogBarrier barrier(y->size(), static_cast<int>(largest), problem.name);
    for (const AffineMatrix& S : inequalities) {
      if (!Add(S, *y, &barrier)) return false;
    }
    barrier.AddSquares(*y, y->size() - problem.damped, problem.damped, kDamping);
    Vector step;
    const double decrement = barrier.Step(&step);
    if (!(decrement >= 0)) return false;
    *y += step;
    if (decrement < kCentred) break;
  }
  return true;
}

}  // namespace

double LowerRate(const RateProblem& problem, Vector* y) {
  BudgetStage stage(problem.name.c_str());
  Vector now = *y;
  double best = problem.rate(now), rho = kAbove * best;
  for (int k = 0; k < kMaxCentres && best > problem.good_enough && std::isfinite(rho); ++k) {
    stage.Next();
    if (!Centre(problem, problem.inequalities(rho), &now)) break;
    const double rate = problem.rate(now);
    if (!std::isfinite(rate)) break;
    if (rate < best) {
      best = rate;
      *y = now;
    }
    const double lowered = (1 - kTowards) * rate + kTowards * rho;
    if (!(lowered < (1 - kSlow) * rho)) break;
    rho = lowered;
  }
  return best;
}

}  // namespace contact_flow
