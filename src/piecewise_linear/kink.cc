// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/kink.h"

#include <algorithm>
#include <stdexcept>

#include "cone_interior.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/section.h"

namespace contact_flow {
namespace {

constexpr double kOpposite = 1e-8;  // unit normals that add up to less are opposite
constexpr double kInKinkCone = 1e-9;

void RequireCost(const PiecewiseLinearMap& cost) {
  if (cost.rows() != 1) throw std::invalid_argument("a cost is a map to ℝ");
}

/// Directions of descent of one piece, without linear programs.
std::vector<Vector> Candidates(const LinearPiece& piece) {
  const Vector g = piece.matrix.row(0).transpose();
  std::vector<Vector> candidates = {-g};
  for (Eigen::Index r = 0; r < piece.cone.rows(); ++r) {
    const Vector n = piece.cone.row(r).transpose();
    candidates.push_back(-g + g.dot(n) * n);
  }
  const Matrix edge = NullSpace(piece.cone);
  if (piece.cone.rows() > 0) candidates.push_back(-edge * (edge.transpose() * g));
  return candidates;
}

/// Do the cones share a face of dimension n−1 on {n·d = 0}?
bool Adjacent(const LinearPiece& first, const LinearPiece& second, const Vector& normal) {
  const Matrix face = NullSpace(normal.transpose());
  if (face.cols() == 0) return true;
  Matrix rows(first.cone.rows() + second.cone.rows(), face.cols());
  rows << first.cone * face, second.cone * face;
  Eigen::Index kept = 0;
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const double length = rows.row(r).norm();
    if (length > kOpposite) rows.row(kept++) = (rows.row(r) / length).eval();
  }
  return HasInterior(rows.topRows(kept));
}

}  // namespace

SteepestDescent FindSteepestDescent(const PiecewiseLinearMap& cost) {
  RequireCost(cost);
  const int n = cost.cols();
  SteepestDescent best;
  best.d = Vector::Zero(n);
  const Vector bound = Vector::Ones(n);
  for (std::size_t i = 0; i < cost.pieces().size(); ++i) {
    const LinearPiece& piece = cost.pieces()[i];
    std::vector<Vector> candidates;
    const std::optional<LinearOptimum> optimum =
        LinearProgram(piece.cone, -bound, bound).Maximize(-piece.matrix.row(0).transpose());
    if (optimum) {
      candidates.push_back(optimum->point);
    } else {
      candidates = Candidates(piece);
    }
    for (Vector d : candidates) {
      const double size = d.cwiseAbs().maxCoeff();
      if (!(size > 0) || !d.allFinite()) continue;
      d /= std::max(size, 1e-300);
      if (piece.Margin(d) < -kInKinkCone) continue;
      const double slope = piece.matrix.row(0).dot(d);
      if (slope < best.slope) best = {d, slope, static_cast<int>(i)};
    }
  }
  return best;
}

std::vector<Kink> FindKinks(const PiecewiseLinearMap& cost, double tolerance) {
  RequireCost(cost);
  double largest = 0;
  for (const LinearPiece& piece : cost.pieces()) largest = std::max(largest, piece.matrix.norm());
  std::vector<Kink> kinks;
  for (std::size_t i = 0; i < cost.pieces().size(); ++i) {
    for (std::size_t j = i + 1; j < cost.pieces().size(); ++j) {
      const LinearPiece &first = cost.pieces()[i], &second = cost.pieces()[j];
      for (Eigen::Index r = 0; r < first.cone.rows(); ++r) {
        const Vector normal = first.cone.row(r).transpose();
        bool opposite = false;
        for (Eigen::Index s = 0; s < second.cone.rows(); ++s) {
          opposite = opposite || (second.cone.row(s).transpose() + normal).norm() <= kOpposite;
        }
        if (!opposite || !Adjacent(first, second, normal)) continue;
        const double jump = (first.matrix - second.matrix).row(0).dot(normal);
        if (std::abs(jump) <= tolerance * largest) continue;
        kinks.push_back({static_cast<int>(i), static_cast<int>(j), normal, jump});
      }
    }
  }
  return kinks;
}

}  // namespace contact_flow
