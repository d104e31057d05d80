// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/dop853.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The gaps along a motion with acceleration q̈: a, ȧ = Da v and ä = Da q̈ + Ḋa v, all [n].
struct GapSample {
  Vector gap;
  Vector rate;
  Vector acceleration;
};

/// Evaluates them; `terms` is scratch.
void SampleGaps(const MechanicalSystem& system, const VectorRef& x, const VectorRef& acceleration,
                ConstraintTerms* terms, GapSample* sample);

/// The first event inside a step, if any.
struct LocatedEvent {
  bool found = false;
  double theta = 1;     ///< place in the step, [0, 1]
  int constraint = -1;  ///< a gap that closes (i ∉ J) or a force that vanishes (i ∈ J)
  bool touch = false;   ///< the gap reaches zero and opens again: grazing
};

/// Smallest interior minimum met so far of a gap that stayed open and of a force that kept pushing.
struct GuardMargins {
  double gap = std::numeric_limits<double>::infinity();    ///< [m]
  double force = std::numeric_limits<double>::infinity();  ///< [N]
};

/// Finds the earliest zero of all guards in one step of the integrator: a_i for i ∉ J, λ_i for i ∈
/// J, and −a_i for a compliant i ∈ J.
///
/// Screening costs nothing that the step has not computed: a gap by the Bernstein coefficients of
/// its quintic Hermite interpolant (a, ȧ, ä are known at both ends), a force by its values at the
/// stages. Only a guard that cannot be excluded is searched on the continuous extension, between
/// the roots of its rate, so that a guard which crosses zero twice inside one step is found. A zero
/// counts only if the guard falls below −floor after it; the floor stands for what the integrator
/// cannot resolve. A gap that comes within ten floors and opens again is a touch: the integrator's
/// error does not tell which.
class EventLocator {
 public:
  EventLocator(ContactDynamics* dynamics, double floor);

  /// The contact force of each field call, in the order of the calls of one step.
  void RecordForce(const Vector& force);
  /// Constraints without a guard until this is called again.
  void Ignore(ContactMode constraints) { ignored_ = constraints; }
  /// Starts an arc: no force is known.
  void BeginArc() { calls_ = 0; }
  /// Starts a step, or repeats it: only the force at its beginning is known.
  void BeginStep() { calls_ = calls_ > 0 ? 1 : 0; }
  /// Accepts a step: the force at its end becomes the one at the beginning of the next.
  void EndStep();

  /// `begin` and `end` are the gap samples at the ends of the finished step.
  LocatedEvent Locate(Dop853* stepper, ContactMode mode, const GapSample& begin,
                      const GapSample& end);

  const GuardMargins& margins() const { return margins_; }
  /// As they were before a step that was not accepted.
  void RestoreMargins(const GuardMargins& margins) { margins_ = margins; }

 private:
  /// Whether λ_i is the guard.
  bool IsRigidMember(int i) const;
  /// −1 for a compliant member, whose guard is −a_i.
  double GapSign(int i) const { return mode_.Contains(i) ? -1 : 1; }
  double GuardAt(int i, double theta, double* rate);
  void Search(int i, LocatedEvent* event);

  ContactDynamics* dynamics_;
  const double floor_;
  Dop853* stepper_ = nullptr;
  ContactMode mode_;
  ContactMode ignored_;
  Matrix forces_;  // [n × 16]
  int calls_ = 0;
  ConstraintTerms terms_;
  Vector x_;
  GuardMargins margins_;
};

}  // namespace contact_flow
