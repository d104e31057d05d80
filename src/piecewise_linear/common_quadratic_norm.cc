// SPDX-License-Identifier: BSD-3-Clause
#include "common_quadratic_norm.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "contact_flow/budget.h"
#include "log_barrier.h"

namespace contact_flow {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Of a P that is to be trusted in double precision, with ones on its diagonal: in other units of y
/// it is the same.
constexpr double kLargestNormCondition = 1e12;
constexpr int kMaxNormCentres = 60, kMaxNormNewton = 30;
constexpr double kNormCentred = 0.3;  // Newton decrement at which γ may be lowered
constexpr double kNormTowards = 0.1;  // γ ← (1 − θ) rate² + θ γ
constexpr double kSlowNorm = 1e-4;    // relative gain per centre at which to stop
/// From a P further from I than this the search begins again, in coordinates in which it is I.
constexpr double kFarNorm = 1e4;
constexpr int kMaxNormStarts = 6;
constexpr double kWorthNormStart = 1e-3;  // relative gain of one that is worth another

/// The barrier −Σ log det(γP − A_iᵀPA_i) − log det P − log det(I − P) in the entries of P on and
/// above the diagonal, N = n(n+1)/2 of them.
class Barrier {
 public:
  Barrier(const std::vector<Matrix>& matrices, double gamma)
      : matrices_(matrices), gamma_(gamma), n_(static_cast<int>(matrices.front().rows())) {}

  /// One damped Newton step; returns the decrement before it, NaN when P was not inside.
  double Step(Matrix* P) const {
    const std::string purpose = "a common quadratic norm of " + std::to_string(n_) + " dimensions";
    LogBarrier barrier(n_ * (n_ + 1) / 2, n_, purpose);
    const double outside = std::numeric_limits<double>::quiet_NaN();
    bool inside =
        Add(*P, -1, nullptr, &barrier) && Add(Matrix::Identity(n_, n_) - *P, 1, nullptr, &barrier);
    for (std::size_t i = 0; inside && i < matrices_.size(); ++i) {
      AskBudget();
      const Matrix& A = matrices_[i];
      inside = Add(gamma_ * *P - A.transpose() * *P * A, -1, &A, &barrier);
    }
    if (!inside) return outside;
    Vector step;
    const double decrement = barrier.Step(&step);
    if (!(decrement >= 0)) return outside;
    int k = 0;
    for (int c = 0; c < n_; ++c) {
      for (int r = 0; r <= c; ++r, ++k) {
        (*P)(r, c) += step(k);
        (*P)(c, r) = (*P)(r, c);
      }
    }
    return decrement;
  }

 private:
  /// Adds −log det S, dS = −sign·E for a basis matrix E, or γE − AᵀEA if A is given.
  bool Add(const Matrix& S, double sign, const Matrix* A, LogBarrier* barrier) const {
    const Eigen::LLT<Matrix> factor(S);
    if (factor.info() != Eigen::Success) return false;
    const Matrix root = factor.matrixL().solve(Matrix::Identity(n_, n_));  // R, R S Rᵀ = I
    const Matrix moved = A != nullptr ? Matrix(root * A->transpose()) : Matrix();
    Matrix directions(n_ * n_, n_ * (n_ + 1) / 2);
    int k = 0;
    for (int c = 0; c < n_; ++c) {
      for (int r = 0; r <= c; ++r, ++k) {
        Eigen::Map<Matrix> direction(directions.col(k).data(), n_, n_);
        direction = (A != nullptr ? gamma_ : -sign) * Product(root, r, c);
        if (A != nullptr) direction -= Product(moved, r, c);
      }
    }
    barrier->Add(directions);
    return true;
  }
  /// R E Rᵀ for the basis matrix with ones at (r, c) and (c, r).
  static Matrix Product(const Matrix& R, int r, int c) {
    const Matrix product = R.col(r) * R.col(c).transpose();
    return r == c ? product : Matrix(product + product.transpose());
  }

  const std::vector<Matrix>& matrices_;
  const double gamma_;
  const int n_;
};

/// The search from I.
CommonQuadraticNorm SeekNorm(const std::vector<Matrix>& matrices, double good_enough,
                             const std::function<bool()>& cancelled) {
  const Eigen::Index n = matrices.front().rows();
  CommonQuadraticNorm best;
  best.P = Matrix::Identity(n, n);
  best.rate = QuadraticRate(matrices, best.P);
  if (!(best.rate > good_enough) || !std::isfinite(best.rate)) return best;
  BudgetStage stage("the common quadratic norm");
  Matrix P = 0.5 * best.P;
  double gamma = 1.1 * best.rate * best.rate;
  for (int centre = 0; centre < kMaxNormCentres; ++centre) {
    const Barrier barrier(matrices, gamma);
    for (int k = 0; k < kMaxNormNewton; ++k) {
      if (cancelled && cancelled()) return best;
      AskBudget();
      stage.Next();
      const double decrement = barrier.Step(&P);
      if (!(decrement >= 0)) return best;
      if (decrement < kNormCentred) break;
    }
    const double rate = QuadraticRate(matrices, P);
    if (!std::isfinite(rate)) return best;
    if (rate < best.rate) {
      best.P = P / P.cwiseAbs().maxCoeff();
      best.rate = rate;
    }
    if (best.rate < good_enough) return best;
    const double lowered = (1 - kNormTowards) * rate * rate + kNormTowards * gamma;
    if (!(lowered < (1 - kSlowNorm) * gamma)) return best;
    gamma = lowered;
  }
  return best;
}

}  // namespace

double QuadraticRate(const std::vector<Matrix>& matrices, const MatrixRef& P) {
  const Eigen::Index n = P.rows();
  if (n == 0 || P.cols() != n || !P.allFinite()) return kInfinity;
  if (!(P.diagonal().minCoeff() > 0)) return kInfinity;
  const Vector sizes = P.diagonal().cwiseSqrt();
  const Matrix unit_P = sizes.cwiseInverse().asDiagonal() * P * sizes.cwiseInverse().asDiagonal();
  if (!((unit_P - unit_P.transpose()).cwiseAbs().maxCoeff() <= 1e-12)) return kInfinity;
  const Eigen::SelfAdjointEigenSolver<Matrix> spectrum(unit_P);
  const Vector& values = spectrum.eigenvalues();
  if (!(values(0) * kLargestNormCondition > values(n - 1)) || !(values(0) > 0)) return kInfinity;
  const Matrix root =
      values.cwiseSqrt().asDiagonal() * spectrum.eigenvectors().transpose() * sizes.asDiagonal();
  const Matrix inverse = sizes.cwiseInverse().asDiagonal() * spectrum.eigenvectors() *
                         values.cwiseSqrt().cwiseInverse().asDiagonal();
  double rate = 0;
  for (const Matrix& A : matrices) {
    AskBudget();
    if (A.rows() != n || A.cols() != n || !A.allFinite()) return kInfinity;
    Matrix moved = root * A * inverse;
    if (!moved.allFinite()) return kInfinity;
    const double largest = moved.cwiseAbs().maxCoeff();
    if (largest == 0) continue;
    const double unit = std::ldexp(1, std::ilogb(largest));  // squares neither overflow nor vanish
    moved /= unit;
    const Eigen::SelfAdjointEigenSolver<Matrix> gain(moved.transpose() * moved,
                                                     Eigen::EigenvaluesOnly);
    rate = std::max(rate, unit * std::sqrt(std::max(0.0, gain.eigenvalues()(n - 1))));
  }
  return rate;
}

CommonQuadraticNorm FindCommonQuadraticNorm(const std::vector<Matrix>& matrices, double good_enough,
                                            const std::function<bool()>& cancelled) {
  CommonQuadraticNorm best = SeekNorm(matrices, good_enough, cancelled);
  for (int start = 1; start < kMaxNormStarts; ++start) {
    if (!(best.rate > good_enough) || (cancelled && cancelled())) break;
    const Eigen::LLT<Matrix> factor(best.P);
    const Vector sizes = Eigen::SelfAdjointEigenSolver<Matrix>(best.P).eigenvalues();
    if (factor.info() != Eigen::Success || !(sizes.maxCoeff() > kFarNorm * sizes.minCoeff())) break;
    const Matrix T = factor.matrixU();
    const Matrix inverse = T.inverse();
    std::vector<Matrix> moved;
    for (const Matrix& A : matrices) moved.push_back(T * A * inverse);
    const CommonQuadraticNorm next = SeekNorm(moved, good_enough, cancelled);
    Matrix P = T.transpose() * next.P * T;
    P = 0.5 * (P + P.transpose()).eval();
    const double rate = QuadraticRate(matrices, P);
    if (!(rate < best.rate)) break;
    const bool is_worth_another = rate < (1 - kWorthNormStart) * best.rate;
    best.P = P / P.cwiseAbs().maxCoeff();
    best.rate = rate;
    if (!is_worth_another) break;
  }
  return best;
}

}  // namespace contact_flow
