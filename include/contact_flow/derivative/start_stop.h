// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What a start with contacts that stick does to a direction w that makes them slip: they are
/// stopped after a time of first order, (F7) of all of them at once,
///   Ξ = I − [0; M⁻¹ W (A M⁻¹ W)⁻¹ E] D(T v).
/// That holds where every contact stays closed meanwhile, and none that is open is hit.
class StartStop {
 public:
  /// Of a start where nothing sticks: Ξ = I.
  StartStop() = default;
  /// Of the start x [nq+d] in `mode`. `dynamics` is scratch.
  StartStop(std::shared_ptr<ContactDynamics> dynamics, const VectorRef& x, ContactMode mode);

  bool Empty() const { return matrix_.size() == 0; }
  /// Ξ [2d+k × 2d+k]; empty for I.
  const Matrix& matrix() const { return matrix_; }
  /// Ξ w. Throws std::domain_error where the slips of w do not end so, as a contact lets go or
  /// goes on slipping, or one of `brushed` is hit (StartCone::Brushed).
  Vector operator()(const VectorRef& w, ConstraintSet brushed) const;
  /// kOk where (F7) is known to hold for every w: no friction within the cones lifts a contact.
  Status PiecewiseLinear() const;

 private:
  std::shared_ptr<ContactDynamics> dynamics_;
  Vector x_;
  ContactMode mode_;
  Matrix rate_jacobian_;  // D(A v) [n+l+r × 2d+k]
  Matrix matrix_;
};

}  // namespace contact_flow
