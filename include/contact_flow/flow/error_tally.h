// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/flow/stepper.h"
#include "contact_flow/model/configuration_space.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What the local errors of an integrator's steps add up to, as a tangent (e_q, e_v) [2d]:
///   e_q ← e_q + h e_v + ε_q,   e_v ← e_v + ε_v,
/// where ε is the estimated local error of a step and the rounding of its end. An estimate, not a
/// bound: that the dynamics let errors grow, or damp them, is not in it. Allocates once.
class ErrorTally {
 public:
  explicit ErrorTally(const ConfigurationSpace& space)
      : space_(&space), error_(Vector::Zero(2 * space.dof())) {}

  /// The step that was tried last is accepted.
  void AddStep(const Stepper& stepper);
  /// Impacts of constraints with gradients `rows` [k×d] and rates Da v⁻ [k] at which the velocity
  /// jumps by v⁺ − v⁻ [d]. One that comes early or late leaves an error in the positions, with its
  /// sign: e_q ← |I + (v⁺ − v⁻) Da / (Da v⁻)| e_q, so that a bounce turns an error and does not add
  /// to it. Of several e_q ← e_q + |v⁺ − v⁻| max_i(|Da_i| e_q) / max_i |Da_i v⁻|: what one adds to
  /// the jump goes with its rate.
  void AddImpact(const Matrix& rows, const Vector& rates, const VectorRef& jump);
  /// What this has become after so many seconds in which `later` was added.
  void Continue(double seconds, const ErrorTally& later) {
    const int d = space_->dof();
    error_.head(d) += seconds * error_.tail(d);
    error_ += later.error_;
  }
  void Reset() { error_.setZero(); }

  const Vector& error() const { return error_; }

 private:
  const ConfigurationSpace* space_;
  Vector error_;
};

}  // namespace contact_flow
