// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/derivative/cone_interior.h"
#include "contact_flow/derivative/piecewise_linear_map.h"

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

}  // namespace test
}  // namespace contact_flow
