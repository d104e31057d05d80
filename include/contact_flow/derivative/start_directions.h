// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/QR>
#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The directions in which a run may start elsewhere, for a start x in the contact mode J. Runs
/// from x + α w have the derivative B(w) only where
///   Da_J w_q + ∂a_J/∂p δp = 0,  D(Da_J v) w + Da_J w_v = 0,   the same of bilateral constraints,
///                                      and T v = 0 of contacts without slip: J is kept,
///   w ∈ the StartCone:                 constraints that are touched outside J are not entered,
///                                      and a slip that begins is not reversed.
/// What keeps J is told within 1e-9 of the largest entry of w.
class StartDirections {
 public:
  /// Every direction of `size` entries.
  explicit StartDirections(int size = 0);
  /// `cone` is that of x and `mode`: BDerivative::start.
  StartDirections(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                  const StartCone& cone, const Variables& variables = {});

  /// Whether a run may start in a direction, or why not.
  struct Judgement {
    /// Why not.
    enum class Kind {
      kAdmitted,      ///< it may
      kLeavesMode,    ///< a contact of J opens or is entered, by w or its rate, also where no
                      ///< state keeps J, as its rows are dependent
      kLeavesDomain,  ///< w leads through a constraint that the start touches outside J
      kAgainstSlip,   ///< w reverses a contact that begins to slip at the start
    };
    Kind kind = Kind::kAdmitted;  ///< the first that applies
    int constraint = -1;          ///< whose; −1 for kLeavesMode
    bool ok() const { return kind == Kind::kAdmitted; }
  };
  /// Of w [2d+k], or [2d] with (δu, δp) = 0. Throws std::invalid_argument for a number that is
  /// not finite.
  Judgement Judge(const VectorRef& w) const;
  /// "leaves the contact mode {floor} of the start", to stand behind the name of the direction.
  std::string Sentence(const Judgement& judgement) const;
  /// w with the shortest change of (w_q, w_v) that keeps J, as ProjectAdmissible; zero where
  /// nothing but rounding is left.
  Vector Project(const VectorRef& w) const;
  /// The matrix of Project [2d+k × 2d+k].
  Matrix Projector() const;
  /// Whether every direction keeps J.
  bool KeepsAll() const { return rows_.rows() == 0; }

 private:
  bool MovesApart(const Vector& w) const;

  int states_ = 0;  // 2d
  Matrix rows_;     // gradients of what J keeps at zero [· × 2d+k]
  Eigen::CompleteOrthogonalDecomposition<Matrix> solver_;  // of their first 2d columns
  StartCone cone_;
  std::string mode_;
  std::vector<std::string> names_;  // of all constraints
};

}  // namespace contact_flow
