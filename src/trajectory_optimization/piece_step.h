// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <string>
#include <vector>

#include "contact_flow/trajectory_optimization/piece_models.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The step that one piece asks for, with the multipliers that certify it.
struct PieceStep {
  bool solved = false;    ///< false: there is none
  std::string failure;    ///< and why, as a sentence
  bool reachable = true;  ///< false: no step within the bounds leads into the piece
  Vector d;               ///< [n]
  double decrease = 0;    ///< −(gᵀd + ½ dᵀHd), what is promised
  Vector multipliers;   ///< z ≥ 0 of the order rows, of any sign for equalities [h]; J rises by z
                        ///< for each second into the piece where its row is active [1/s]
  double residual = 0;  ///< |g + Hd − Aᵀz| on unknowns off their bounds, largest entry
  std::vector<bool> bounded;  ///< unknowns that stay at a bound [n]
};

/// The curvature that each unknown has by itself, in its own units: |H_ii|, the largest of all
/// where that is 0.
Vector SizesOfCurvature(const Matrix& H);

/// The factor of H, or of H with a small part of each of its sizes where H is singular to rounding:
/// a cost that leaves directions free, as one without effort. Its info() is Eigen::Success unless H
/// is not finite.
Eigen::LLT<Matrix> FactorOf(const Matrix& H);

/// What of a piece counts in its step.
enum class OrderRule {
  kKeep,    ///< slack + row·d ≥ 0
  kIgnore,  ///< the step may leave the piece
};

/// min gᵀd + ½ dᵀ(H + damping S)d with lower ≤ y + d ≤ upper and the order rows, S the diagonal of
/// SizesOfCurvature: other units of y damp the same. Those in `equal` are met with equality
/// whatever the rule.
PieceStep SolvePiece(const PieceModel& piece, const Vector& y, const Vector& lower,
                     const Vector& upper, OrderRule rule, const std::vector<int>& equal = {},
                     double damping = 0);

}  // namespace contact_flow
