// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/types.h"

namespace contact_flow {

/// How far the numbers of a B-derivative can be trusted: the laws that it was held to, and the
/// errors that are left. A law is a residual relative to the sizes of its own terms; 0 where there
/// was nothing to check. One that fails withholds the derivative and is named in its status.
struct Trust {
  double flow_law = 0;   ///< Φ F(x(t₀)) = F(x(t₁)) along the arcs
  double event_law = 0;  ///< B_k(F⁻) = F⁺ at the transitions
  double face_law = 0;   ///< selections of neighbouring orders agree on the face that they share
  double momentum = 0;   ///< M (v⁺ − v⁻) = Daᵀ p + Dbᵀ r at the impacts
  /// Kinetic energy won at an impact whose constraints have one common γ ≤ 1,
  /// relative to that before.
  double energy = 0;
  /// Largest estimated condition of what was inverted at the transitions: M and the Delassus matrix
  /// of the contacts, each scaled to a unit diagonal.
  double condition = 1;
  /// Estimated error of x(T), as a tangent (δq, δv) [2d]: the local errors of the integrator,
  /// carried to T by the derivative itself.
  Vector state_error;
  /// Estimated error of an entry of B, absolute. BDerivative::Error gives that of one direction.
  double derivative_error = 0;
  /// The arc whose local errors weigh most at T; −1 when none does.
  int weakest_arc = -1;
};

/// Residuals above this fail a law.
inline constexpr double kLawLimit = 1e-6;

}  // namespace contact_flow
