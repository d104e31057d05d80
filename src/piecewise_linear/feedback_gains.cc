// SPDX-License-Identifier: BSD-3-Clause
// The matrix inequalities of feedbacks, in unknowns of one vector.
#include "feedback_gains.h"

#include <Eigen/LU>
#include <algorithm>
#include <string>

#include "balance.h"
#include "common_quadratic_norm.h"
#include "matrix_inequalities.h"

namespace contact_flow {
namespace {

/// (A, B) of a piece, with inputs of unit size.
struct Pair {
  Matrix A, B;
};

std::vector<Pair> PairsOf(const PiecewiseLinearMap& step, const Vector& sizes) {
  const int n = step.rows(), m = step.cols() - n;
  std::vector<Pair> pairs;
  for (const LinearPiece& piece : step.pieces()) {
    pairs.push_back(
        {piece.matrix.leftCols(n), piece.matrix.rightCols(m) * sizes.cwiseInverse().asDiagonal()});
  }
  return pairs;
}

/// [D Mᵀ; M D] of equal square blocks.
Matrix Bordered(const Matrix& D, const Matrix& M) {
  const Eigen::Index n = D.rows();
  Matrix S(2 * n, 2 * n);
  S << D, M.transpose(), M, D;
  return S;
}

/// The unknowns (Q, Y_1, Y_2, …) of FindGainsAndNorm in one vector.
class JointUnknowns {
 public:
  JointUnknowns(int n, int m, int gains) : n_(n), m_(m), gains_(gains) {}

  int inputs() const { return gains_ * m_ * n_; }
  int size() const { return triangle() + inputs(); }
  Matrix Q(const Vector& y) const {
    Matrix Q(n_, n_);
    for (int c = 0, k = 0; c < n_; ++c) {
      for (int r = 0; r <= c; ++r, ++k) Q(r, c) = Q(c, r) = y(k);
    }
    return Q;
  }
  Matrix Y(const Vector& y, int gain) const {
    return Eigen::Map<const Matrix>(y.data() + triangle() + gain * m_ * n_, m_, n_);
  }
  /// Q = ½ I, no gains.
  Vector Start() const {
    Vector y = Vector::Zero(size());
    for (int c = 0; c < n_; ++c) y(c * (c + 3) / 2) = 0.5;
    return y;
  }

 private:
  int triangle() const { return n_ * (n_ + 1) / 2; }
  const int n_, m_, gains_;
};

Matrix InverseOf(const Matrix& Q) {
  const Matrix P = Q.inverse();
  return 0.5 * (P + P.transpose());
}

}  // namespace

GainsAndNorm FindGainsAndNorm(const PiecewiseLinearMap& step, bool one_for_each, double good_enough,
                              const std::function<bool()>& cancelled) {
  const int n = step.rows(), m = step.cols() - n;
  const Vector sizes = EffectsOfInputs(step);
  const std::vector<Pair> pairs = PairsOf(step, sizes);
  const int gains = one_for_each ? static_cast<int>(pairs.size()) : 1;
  const JointUnknowns unknowns(n, m, gains);
  const auto gain_of = [&](std::size_t i) { return one_for_each ? static_cast<int>(i) : 0; };
  const auto closed = [&](std::size_t i, const Vector& y) {  // (A_i + B_iK) Q
    return Matrix(pairs[i].A * unknowns.Q(y) + pairs[i].B * unknowns.Y(y, gain_of(i)));
  };
  RateProblem problem;
  problem.name = "the inequalities of feedback and norm";
  problem.damped = unknowns.inputs();
  problem.good_enough = good_enough;
  problem.cancelled = cancelled;
  problem.rate = [&](const Vector& y) {
    const Matrix P = InverseOf(unknowns.Q(y));
    std::vector<Matrix> loops;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      loops.push_back(pairs[i].A + pairs[i].B * (unknowns.Y(y, gain_of(i)) * P));
    }
    return QuadraticRate(loops, P);
  };
  problem.inequalities = [&](double rho) {
    std::vector<AffineMatrix> all(pairs.size() + 1);
    for (std::size_t i = 0; i < pairs.size(); ++i) all[i].constant = Matrix::Zero(2 * n, 2 * n);
    all.back().constant = Matrix::Identity(n, n);  // Q < I
    for (int k = 0; k < unknowns.size(); ++k) {
      const Vector unit = Vector::Unit(unknowns.size(), k);
      const Matrix Q = unknowns.Q(unit);
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        all[i].slopes.push_back(Bordered(rho * Q, closed(i, unit)));
      }
      all.back().slopes.push_back(-Q);
    }
    return all;
  };

  Vector y = unknowns.Start();
  GainsAndNorm found;
  found.rate = LowerRate(problem, &y);
  found.P = InverseOf(unknowns.Q(y));
  for (int k = 0; k < gains; ++k) {
    found.gains.push_back(sizes.cwiseInverse().asDiagonal() * unknowns.Y(y, k) * found.P);
  }
  found.P /= found.P.cwiseAbs().maxCoeff();
  return found;
}

}  // namespace contact_flow
