// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/LU>

#include "contact_flow/types.h"

namespace contact_flow {

/// What a step of length h of a stiff rule leaves of a defect δ of accelerations ÿ = K y + D ẏ,
///   (I − h D)⁻² δ.
/// A mode that decays at a rate r is off by δ/r where its acceleration is off by δ, not by h δ: the
/// first factor, as Hairer & Wanner II, Sec. IV.8 filter the errors of Radau's method. The second
/// one is for what of that has decayed where the step ends. Modes that are slow beside the step
/// keep their defect. It is for slips in space that are slow: they turn at up to 1e12/s, and are
/// known to so few digits that rounding of their direction makes defects of 1e-7 h r, which are no
/// errors and which no step is short enough for.
class DecayedDefect {
 public:
  /// [K D …] where the defect is, in d rows.
  void At(const Matrix& jacobian, double h) {
    const Eigen::Index d = jacobian.rows();
    matrix_ = -h * jacobian.middleCols(d, d);
    matrix_.diagonal().array() += 1;
    lu_.compute(matrix_);
  }
  /// Replaces δ [d × ·] by it.
  template <class Defect>
  void Apply(Defect* defect) const {
    *defect = lu_.solve(lu_.solve(*defect).eval()).eval();
  }

 private:
  Matrix matrix_;
  Eigen::PartialPivLU<Matrix> lu_;
};

}  // namespace contact_flow
