// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "scenario.h"

namespace contact_flow {
namespace benchmark {

/// What every peer integrates: the right-hand side of the present contact mode, its guards and its
/// transitions, all by the package's own generic model interface. Feet are never released in the
/// scenarios: a force that pulls throws, rather than that each peer locates it.
class HybridSystem {
 public:
  explicit HybridSystem(const Scenario& scenario);

  /// Back to the initial mode; counts right-hand sides from zero.
  void Reset();
  /// ẋ = F_J(x) [14].
  void Field(const double* x, double* xdot);
  /// D_x q̈ [7×14].
  const Matrix& AccelerationJacobian(const double* x);
  /// a(q) and Da v of every constraint that is not active; +1 and 0 for the active ones.
  void Gaps(const double* x, double* gap, double* rate);
  /// Passes the event of constraint `trigger` at (t, x): changes mode and state.
  const Transition& Pass(double t, int trigger, double* x);

  int num_constraints() const { return system_.num_constraints(); }
  long right_hand_sides() const { return dynamics_.evaluations() - counted_; }

 private:
  const MechanicalSystem& system_;
  ContactDynamics dynamics_;
  ConstraintTerms terms_;
  ContactMode mode_;
  ContactMode initial_mode_;
  Vector x_;
  Transition transition_;
  long counted_ = 0;
};

}  // namespace benchmark
}  // namespace contact_flow
