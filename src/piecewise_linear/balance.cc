// SPDX-License-Identifier: BSD-3-Clause
#include "balance.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// A round moves sizes as if each pair was coupled by this part of the largest entry, too.
constexpr double kTie = 1e-3;
constexpr int kMaxTies = 60, kMaxOsborne = 60;
constexpr double kSettled = 1e-8;  // largest change of a log of a size

/// By Osborne's method: e with what N e / e gives and takes equal for each, but for diagonals.
/// Returns the largest |log e| of the last sweep; `e` is multiplied.
double Sweep(const Matrix& N, Vector* e) {
  double moved = 0;
  for (Eigen::Index j = 0; j < N.rows(); ++j) {
    const double own = N(j, j);
    const double in = (N.row(j).dot(*e) - own * (*e)(j)) / (*e)(j);
    const double out = (N.col(j).dot(e->cwiseInverse()) - own / (*e)(j)) * (*e)(j);
    const double factor = std::sqrt(in / out);
    if (!(factor > 0) || !std::isfinite(factor)) continue;
    (*e)(j) *= factor;
    moved = std::max(moved, std::abs(std::log(factor)));
  }
  return moved;
}

}  // namespace

Vector BalancedSizes(const PiecewiseLinearMap& map) {
  const Eigen::Index n = map.rows();
  Vector sizes = Vector::Ones(n);
  if (n < 2) return sizes;
  Matrix largest = Matrix::Zero(n, n);
  for (const LinearPiece& piece : map.pieces()) {
    largest = largest.cwiseMax(piece.matrix.leftCols(n).cwiseAbs());
  }
  if (!largest.allFinite()) return sizes;
  // Each round starts from where the one before has ended, so that the tie has no effect where it
  // is not needed (the method of proximal points; the sums are convex in log d).
  for (int round = 0; round < kMaxTies; ++round) {
    AskBudget();
    Matrix N = InSizes(PiecewiseLinearMap::Linear(largest), sizes, sizes).pieces().front().matrix;
    N /= std::max(1.0, N.maxCoeff());
    N.array() += kTie;
    N.diagonal().setZero();
    Vector e = Vector::Ones(n);
    for (int k = 0; k < kMaxOsborne && Sweep(N, &e) > kSettled; ++k) continue;
    e /= std::exp(e.array().log().mean());
    sizes = sizes.cwiseProduct(e);
    if (e.array().log().abs().maxCoeff() <= kSettled) break;
  }
  return sizes;
}

Vector EffectsOfInputs(const PiecewiseLinearMap& map) {
  const Eigen::Index m = map.cols() - map.rows();
  Vector effects = Vector::Zero(m);
  for (const LinearPiece& piece : map.pieces()) {
    effects = effects.cwiseMax(piece.matrix.rightCols(m).colwise().norm().transpose());
  }
  return (effects.array() > 0).select(effects, 1.0);
}

PiecewiseLinearMap InSizes(const PiecewiseLinearMap& map, const Vector& to, const Vector& from) {
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) {
    for (Eigen::Index c = 0; c < from.size(); ++c) {
      for (Eigen::Index r = 0; r < to.size(); ++r) piece.matrix(r, c) *= from(c) / to(r);
    }
    for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
      const Eigen::RowVectorXd row = piece.cone.row(r).cwiseProduct(from.transpose());
      const double length = row.stableNorm();
      if (length > 0) piece.cone.row(r) = row / length;
    }
  }
  return PiecewiseLinearMap(std::move(pieces));
}

Matrix FormInUnits(const Matrix& P, const Vector& sizes) {
  const Vector inverse = sizes.cwiseInverse();
  Matrix form = inverse.asDiagonal() * P * inverse.asDiagonal();
  form = 0.5 * (form + form.transpose()).eval();
  return form / form.cwiseAbs().maxCoeff();
}

Matrix RowsInUnits(const Matrix& T, const Vector& sizes) {
  return T * sizes.cwiseInverse().asDiagonal();
}

}  // namespace contact_flow
