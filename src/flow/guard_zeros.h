// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/transition.h"
#include "src/dynamics/guard_gradients.h"

namespace contact_flow {

/// A guard near its zero.
struct GuardZero {
  double value, slope;  ///< the slope along the run
  double error;         ///< estimated, of the instant at which it vanishes [s]
  double reach;         ///< what errors may have made of the value, at most
};

/// The guards with friction at the state of an event, and how well their instants are known:
/// δt ≤ δg/|ġ|. A gap that grazes is turned by its acceleration ä, δt ≤ √(2 δa/|ä|); any other
/// slope that is lost in its own terms says nothing.
class GuardZeros {
 public:
  GuardZeros(ContactDynamics* dynamics, double t, const Vector& x, const ContactMode& mode,
             int trigger, const TransitionRules& rules);

  GuardZero At(int guard) const;
  /// The guards that are functions of forces.
  ConstraintSet forces() const { return gradients_.forces(); }
  bool SlipInSpaceEnds() const { return gradients_.SlipInSpaceEnds(); }
  /// ä of the gaps in the mode before [n].
  const Vector& acceleration() const { return acceleration_; }

 private:
  bool IsOpenGap(int guard) const;
  double KnownTo(int guard, const Eigen::RowVectorXd& terms) const;

  const int n_, d_;
  const double t_;
  const ContactMode mode_;
  const ClosedGaps* const closed_;
  const double tolerance_;  // of gaps [m]
  const GuardGradients gradients_;
  Vector error_, reach_;  // of the state [2d]
  Vector rounding_;       // of the positions [d]
  Vector acceleration_;   // of the gaps [n]
};

}  // namespace contact_flow
