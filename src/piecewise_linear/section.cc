// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/section.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "cone_interior.h"
#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kRank = 1e-9;
/// A half-space whose normal shrinks to this is the whole space.
constexpr double kVanishedNormal = 1e-12;

Matrix Orthonormal(const MatrixRef& columns, Eigen::Index n) {
  if (columns.rows() != n) {
    throw std::invalid_argument("directions of " + std::to_string(columns.rows()) +
                                " entries in a space of " + std::to_string(n) + " dimensions");
  }
  if (columns.size() == 0) return Matrix::Zero(n, 0);
  Eigen::JacobiSVD<Matrix> parts(columns, Eigen::ComputeThinU);
  parts.setThreshold(kRank);
  return parts.matrixU().leftCols(parts.rank());
}

void RequireSquare(const PiecewiseLinearMap& map) {
  if (map.rows() != map.cols()) {
    throw std::invalid_argument("only a map of a space into itself can be reduced");
  }
}

double LargestEntry(const PiecewiseLinearMap& map) {
  double largest = std::numeric_limits<double>::min();
  for (const LinearPiece& piece : map.pieces()) {
    if (piece.matrix.size() > 0) largest = std::max(largest, piece.matrix.cwiseAbs().maxCoeff());
  }
  return largest;
}

double Largest(const Matrix& m) { return m.size() > 0 ? m.cwiseAbs().maxCoeff() : 0; }

/// How far the eigenvalues of J [k×k] are from 1, by the traces of (J − I)ʲ, j ≤ k, which vanish
/// where all are: what does not lose digits where J has no basis of eigenvectors.
double FromUnipotent(const Matrix& J) {
  const Matrix rest = J - Matrix::Identity(J.rows(), J.cols());
  const double scale = std::max(1.0, Largest(J));
  double away = 0, size = 1;
  Matrix power = Matrix::Identity(J.rows(), J.cols());
  for (Eigen::Index k = 0; k < J.rows(); ++k) {
    power = (power * rest).eval();
    size *= scale;
    away = std::max(away, std::abs(power.trace()) / size);
  }
  return away;
}

/// An orthonormal basis as near to axes as those of its space are: by its projection alone, so that
/// states of unlike units are mixed no more than they are there.
Matrix NearAxes(const Matrix& basis) {
  if (basis.cols() == 0 || basis.rows() == basis.cols()) {
    return Matrix::Identity(basis.rows(), basis.cols());
  }
  const Eigen::ColPivHouseholderQR<Matrix> pivots(basis.transpose());
  Matrix axes = Matrix::Zero(basis.rows(), basis.cols());
  std::vector<Eigen::Index> chosen;
  for (Eigen::Index c = 0; c < basis.cols(); ++c) {
    chosen.push_back(pivots.colsPermutation().indices()(c));
  }
  std::sort(chosen.begin(), chosen.end());
  for (Eigen::Index c = 0; c < basis.cols(); ++c) {
    axes(chosen[static_cast<std::size_t>(c)], c) = 1;
  }
  return NearestBasis(basis, axes);
}

PiecewiseLinearMap LeftMultiply(const Matrix& left, const PiecewiseLinearMap& map) {
  std::vector<LinearPiece> pieces = map.pieces();
  for (LinearPiece& piece : pieces) piece.matrix = (left * piece.matrix).eval();
  return PiecewiseLinearMap(std::move(pieces));
}

/// ds / (ds F).
Eigen::RowVectorXd CrossingRow(const PiecewiseLinearMap& map, const VectorRef& gradient,
                               const VectorRef& field) {
  if (gradient.size() != map.rows() || field.size() != map.rows()) {
    throw std::invalid_argument("gradient and field of a section need " +
                                std::to_string(map.rows()) + " entries");
  }
  const double speed = gradient.dot(field);
  if (!(std::abs(speed) > 0) || !std::isfinite(speed)) {
    throw std::invalid_argument("the flow does not cross the section: ds F = " +
                                std::to_string(speed));
  }
  return gradient.transpose() / speed;
}

}  // namespace

Matrix NullSpace(const MatrixRef& rows) {
  const Eigen::Index n = rows.cols();
  if (rows.size() == 0) return Matrix::Identity(n, n);
  Eigen::JacobiSVD<Matrix> parts(rows, Eigen::ComputeFullV);
  parts.setThreshold(kRank);
  return parts.matrixV().rightCols(n - parts.rank());
}

Matrix NearestBasis(const MatrixRef& basis, const MatrixRef& other) {
  if (basis.rows() != other.rows() || basis.cols() != other.cols()) {
    throw std::invalid_argument("bases of different sizes");
  }
  if (basis.cols() == 0) return basis;
  const Eigen::JacobiSVD<Matrix> parts(basis.transpose() * other,
                                       Eigen::ComputeFullU | Eigen::ComputeFullV);
  return basis * (parts.matrixU() * parts.matrixV().transpose());
}

PiecewiseLinearMap InBases(const PiecewiseLinearMap& map, const MatrixRef& end,
                           const MatrixRef& start) {
  if (end.rows() != map.rows() || start.rows() != map.cols()) {
    throw std::invalid_argument("bases of other spaces than those of the map");
  }
  std::vector<LinearPiece> pieces;
  for (const LinearPiece& piece : map.pieces()) {
    AskBudget();
    LinearPiece seen = piece;
    seen.matrix = end.transpose() * piece.matrix * start;
    const Matrix rows = piece.cone * start;
    seen.cone.resize(rows.rows(), rows.cols());
    Eigen::Index kept = 0;
    for (Eigen::Index r = 0; r < rows.rows(); ++r) {
      const double length = rows.row(r).norm();
      if (length > kVanishedNormal) seen.cone.row(kept++) = rows.row(r) / length;
    }
    seen.cone.conservativeResize(kept, rows.cols());
    if (HasInterior(seen.cone)) pieces.push_back(std::move(seen));
  }
  return PiecewiseLinearMap(std::move(pieces));
}

PiecewiseLinearMap CrossingTime(const PiecewiseLinearMap& map, const VectorRef& gradient,
                                const VectorRef& field) {
  return LeftMultiply(-CrossingRow(map, gradient, field), map);
}

PiecewiseLinearMap OntoSection(const PiecewiseLinearMap& map, const VectorRef& gradient,
                               const VectorRef& field) {
  const Matrix along = field * CrossingRow(map, gradient, field);
  return LeftMultiply(Matrix::Identity(map.rows(), map.rows()) - along, map);
}

ReducedMap RestrictToInvariant(const PiecewiseLinearMap& map, const MatrixRef& subspace) {
  RequireSquare(map);
  const Matrix V = Orthonormal(subspace, map.rows());
  const Eigen::Index n = map.rows();
  ReducedMap reduced{InBases(map, V, V), V, 0};
  const PiecewiseLinearMap outside = InBases(map, Matrix::Identity(n, n) - V * V.transpose(), V);
  reduced.residual = LargestEntry(outside) / LargestEntry(map);
  return reduced;
}

ReducedMap SetAside(const PiecewiseLinearMap& map, const MatrixRef& neutral) {
  const Eigen::Index n = map.rows(), inputs = map.cols() - n;
  if (inputs < 0) throw std::invalid_argument("only a map of a space into itself can be reduced");
  const Matrix N = Orthonormal(neutral, n);
  const Matrix Q = NearAxes(NullSpace(N.transpose()));
  Matrix start = Matrix::Zero(n + inputs, Q.cols() + inputs);
  start.topLeftCorner(n, Q.cols()) = Q;
  start.bottomRightCorner(inputs, inputs).setIdentity();
  ReducedMap reduced{InBases(map, Q, start), Q, 0};
  const double scale = LargestEntry(map);
  if (N.cols() == 0) return reduced;
  const Matrix J = N.transpose() * map.pieces().front().matrix.leftCols(n) * N;
  reduced.residual = FromUnipotent(J);
  for (const LinearPiece& piece : map.pieces()) {
    const Matrix along = N.transpose() * piece.matrix.leftCols(n) * N;
    reduced.residual = std::max(reduced.residual, Largest(along - J) / scale);
    reduced.residual =
        std::max({reduced.residual, Largest(Q.transpose() * piece.matrix.leftCols(n) * N) / scale,
                  Largest(piece.cone.leftCols(n) * N)});
  }
  return reduced;
}

}  // namespace contact_flow
