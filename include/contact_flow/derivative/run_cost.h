// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The rate l of a running cost at an instant, and its derivatives.
struct CostRate {
  double value = 0;    ///< l
  Vector by_state;     ///< ∂l/∂x, x = (q, v) as numbers [nq+d]
  Vector by_input;     ///< ∂l/∂u [m]
  double by_time = 0;  ///< ∂l/∂t; 0 where l does not name t
};

/// What a run costs: a number,
///   J = g(x(T)) + ∫ l(t, x(t), u(t)) dt,      x = (q, v) [nq+d].
/// Both parts may be left out. l may depend on velocities, which jump: then J is still Lipschitz.
struct RunCost {
  /// g, and ∂g/∂x [nq+d] into a vector that has this size.
  std::function<double(const Vector& x, Vector* by_state)> terminal;
  /// l and its derivatives into vectors that have their sizes.
  std::function<void(double t, const Vector& x, const Vector& u, CostRate* rate)> running;
  /// In its place where l depends on the contact mode, too, as a sum over the contacts that touch:
  /// l then jumps where one touches down or lets go.
  std::function<void(double t, const Vector& x, const Vector& u, ContactMode mode, CostRate* rate)>
      running_in_mode;

  /// Whether there is an l.
  bool HasRate() const { return running || running_in_mode; }
  /// l, whichever it is.
  void Rate(double t, const Vector& x, const Vector& u, ContactMode mode, CostRate* rate) const {
    if (running_in_mode) return running_in_mode(t, x, u, mode, rate);
    running(t, x, u, rate);
  }
};

/// J = ½ Σ w_i (x_i(T) − g_i)² + ½ ∫ Σ s_i (x_i − p_i)² + Σ r_j (u_j − ū_j)² dt. An empty
/// vector is zero.
struct QuadraticCost {
  Vector weight;           ///< w ≥ 0 [nq+d]
  Vector target;           ///< g [nq+d]
  Vector state_weight;     ///< s ≥ 0 [nq+d]
  Vector state_reference;  ///< p [nq+d]
  Vector input_weight;     ///< r ≥ 0 [m]
  Vector input_reference;  ///< ū [m]

  /// The same as functions. Throws std::invalid_argument, naming the field, for sizes, for numbers
  /// that are not finite, and for negative weights.
  RunCost Make(const MechanicalSystem& system) const;
};

/// ∂J/∂x as numbers [nq+d] by tangents (δq, δv) at x [2d]: N(q)ᵀ of its first part.
Vector ByTangents(const MechanicalSystem& system, const Vector& x, const Vector& by_state);

}  // namespace contact_flow
