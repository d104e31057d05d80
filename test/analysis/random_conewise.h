// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "src/piecewise_linear/cone_interior.h"

/// Random continuous piecewise-linear maps, for tests.
namespace contact_flow {
namespace test {

inline Matrix RandomMatrix(int rows, int cols, std::mt19937* generator) {
  std::normal_distribution<double> normal;
  Matrix m(rows, cols);
  for (Eigen::Index i = 0; i < m.size(); ++i) m(i) = normal(*generator);
  return m;
}

/// y ↦ A y + Σ_k b_k |c_k·y|, continuous by its form; one piece for each cell of the hyperplanes
/// c_k·y = 0 that has interior. A [r×n], B = (b_k) [r×h], C = (c_k) [h×n].
inline PiecewiseLinearMap SumOfFolds(const Matrix& A, const Matrix& B, const Matrix& C) {
  std::vector<LinearPiece> pieces;
  const int folds = static_cast<int>(C.rows());
  for (int signs = 0; signs < (1 << folds); ++signs) {
    LinearPiece piece;
    piece.matrix = A;
    piece.cone = C;
    for (int k = 0; k < folds; ++k) {
      const double sign = (signs >> k) & 1 ? 1 : -1;
      piece.matrix += sign * B.col(k) * C.row(k);
      piece.cone.row(k) = sign * C.row(k).normalized();
    }
    if (HasInterior(piece.cone)) pieces.push_back(piece);
  }
  return PiecewiseLinearMap(pieces);
}

/// The map of the plane that sends ray k to `images`.col(k) and is linear between neighbouring
/// rays, which are given by increasing angles less than π apart.
inline PiecewiseLinearMap Fan(const std::vector<double>& angles, const Matrix& images) {
  std::vector<LinearPiece> pieces;
  const std::size_t count = angles.size();
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t next = (k + 1) % count;
    Matrix rays(2, 2), values(2, 2);
    rays << std::cos(angles[k]), std::cos(angles[next]), std::sin(angles[k]),
        std::sin(angles[next]);
    values << images.col(k), images.col(next);
    LinearPiece piece;
    piece.matrix = values * rays.inverse();
    piece.cone.resize(2, 2);
    piece.cone << -rays(1, 0), rays(0, 0), rays(1, 1), -rays(0, 1);
    pieces.push_back(piece);
  }
  return PiecewiseLinearMap(pieces);
}

/// w ↦ (max_k c_k·w) b + A w, continuous by its form; its cones are no arrangement of hyperplanes.
inline PiecewiseLinearMap Maximum(const Matrix& A, const Vector& b, const Matrix& C) {
  std::vector<LinearPiece> pieces;
  for (Eigen::Index k = 0; k < C.rows(); ++k) {
    LinearPiece piece;
    piece.matrix = A + b * C.row(k);
    piece.cone.resize(C.rows() - 1, C.cols());
    Eigen::Index row = 0;
    for (Eigen::Index j = 0; j < C.rows(); ++j) {
      if (j != k) piece.cone.row(row++) = (C.row(k) - C.row(j)).normalized();
    }
    if (HasInterior(piece.cone)) pieces.push_back(piece);
  }
  return PiecewiseLinearMap(pieces);
}

/// Sums of folds, maxima, fans of the plane and compositions of them, whose faces do not match one
/// to one; 1 to 64 pieces in up to 14 dimensions.
inline PiecewiseLinearMap RandomRightMap(std::mt19937* generator) {
  const auto pick = [&](int from, int to) {
    return from + static_cast<int>((*generator)() % static_cast<unsigned>(to - from + 1));
  };
  const int n = pick(1, 14), kind = pick(0, 5);
  if (kind == 0) {
    const int h = pick(1, 6), r = pick(1, n);
    return SumOfFolds(RandomMatrix(r, n, generator), RandomMatrix(r, h, generator),
                      RandomMatrix(h, n, generator));
  }
  if (kind == 1) {
    const int rays = pick(3, 64);
    std::vector<double> angles;
    std::uniform_real_distribution<double> jitter(0, 0.4);
    for (int k = 0; k < rays; ++k) angles.push_back(2 * M_PI * (k + jitter(*generator)) / rays);
    return Fan(angles, RandomMatrix(2, rays, generator));
  }
  if (kind <= 3) {
    return Maximum(RandomMatrix(n, n, generator), RandomMatrix(n, 1, generator),
                   RandomMatrix(pick(2, 12), n, generator));
  }
  const PiecewiseLinearMap inner = Maximum(
      RandomMatrix(n, n, generator), RandomMatrix(n, 1, generator), RandomMatrix(4, n, generator));
  const PiecewiseLinearMap outer =
      kind == 4 ? Maximum(RandomMatrix(n, n, generator), RandomMatrix(n, 1, generator),
                          RandomMatrix(4, n, generator))
                : SumOfFolds(RandomMatrix(n, n, generator), RandomMatrix(n, 2, generator),
                             RandomMatrix(2, n, generator));
  return outer.After(inner);
}

}  // namespace test
}  // namespace contact_flow
