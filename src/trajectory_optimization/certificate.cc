// SPDX-License-Identifier: BSD-3-Clause
#include "certificate.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "contact_flow/dynamics/complementarity.h"
#include "piece_step.h"

namespace contact_flow {
namespace {

/// w ≥ 0, Σ w = 1, with the smallest |G w|: that of ½ |G w|² + ½ s (Σ w − 1)² but for its length.
Vector HullWeights(const Matrix& G) {
  const Eigen::Index count = G.cols();
  const Matrix squares = G.transpose() * G;
  const double s = std::max(squares.diagonal().maxCoeff(), 1e-300);
  const Matrix M = squares / s + Matrix::Ones(count, count);
  const std::optional<ComplementaritySolution> found =
      SolveComplementarity(M, -Vector::Ones(count));
  if (!found || !(found->z.sum() > 0))
    return Vector::Constant(count, 1 / static_cast<double>(count));
  return found->z / found->z.sum();
}

}  // namespace

void Certify(const Unknowns& unknowns, const PieceModels& models, const Vector& y,
             TrajectoryOptimum* result) {
  if (!models.status.ok()) return;
  const std::vector<double> grid = unknowns.Inputs(y).grid;
  Matrix G(y.size(), static_cast<Eigen::Index>(models.pieces.size()));
  std::vector<bool> bounded(static_cast<std::size_t>(y.size()), false);
  Eigen::Index count = 0;  // of pieces that steps within the bounds lead into
  for (std::size_t i = 0; i < models.pieces.size(); ++i) {
    const PieceModel& piece = models.pieces[i];
    const PieceStep step =
        SolvePiece(piece, y, unknowns.lower(), unknowns.upper(), OrderRule::kKeep);
    if (!step.reachable) continue;
    PieceProof certificate;
    certificate.label = piece.label;
    certificate.decrease = step.decrease;
    G.col(count++) = piece.gradient;
    if (step.solved) {
      Vector rest = piece.gradient;
      for (std::size_t r = 0; r < piece.orders.size(); ++r) {
        const OrderRow& row = piece.orders[r];
        const double slope = step.multipliers(static_cast<Eigen::Index>(r));
        if (!(slope > 0)) continue;
        rest -= slope * row.row.transpose();
        certificate.slopes.push_back({Describe(unknowns, grid, row.first),
                                      Describe(unknowns, grid, row.second), row.slack, slope});
      }
      for (Eigen::Index k = 0; k < y.size(); ++k) {
        if (!step.bounded[static_cast<std::size_t>(k)]) continue;
        rest(k) = 0;
        bounded[static_cast<std::size_t>(k)] = true;
      }
      certificate.residual = rest.cwiseAbs().maxCoeff();
    }
    result->certificate.push_back(certificate);
  }
  for (Eigen::Index k = 0; k < y.size(); ++k) {
    if (bounded[static_cast<std::size_t>(k)]) G.row(k).setZero();
  }
  if (count == 0) return;
  G.conservativeResize(Eigen::NoChange, count);
  const Vector weights = HullWeights(G);
  for (std::size_t i = 0; i < result->certificate.size(); ++i) {
    result->certificate[i].hull_weight = weights(static_cast<Eigen::Index>(i));
  }
  result->hull_distance = (G * weights).norm();
}

}  // namespace contact_flow
