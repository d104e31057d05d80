// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/force_minima.h"
#include "contact_flow/flow/guard_search.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/stepper.h"
#include "contact_flow/model/narrow_surfaces.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Evaluates the gaps along a motion; `terms` is scratch.
void SampleGaps(const MechanicalSystem& system, const VectorRef& x, const VectorRef& acceleration,
                ConstraintTerms* terms, GapSample* sample);

/// What the locator keeps from step to step: the smallest interior minimum met so far of a gap that
/// stayed open and of a force that kept pushing, and how closely gaps had to be looked at.
struct GuardMargins {
  double gap = std::numeric_limits<double>::infinity();    ///< [m]
  double force = std::numeric_limits<double>::infinity();  ///< [N]
  double piece = std::numeric_limits<double>::infinity();  ///< [s]
  /// The gaps that have touched as the arc begins, or begin within their floor, until they are ten
  /// floors above it.
  ConstraintSet low;
};

/// Finds the earliest zero of all Guards in one step of the integrator: a_i for i ∉ J, λ_i for i ∈
/// J, −a_i for a compliant i ∈ J, and with friction the cones of what sticks and the slips of what
/// slips. Cones are searched like forces. Slips are as quick as the motion.
///
/// The step is chosen for the motion. A guard may be far quicker: a ball that flies over a rough
/// ground, a force that follows a clock on a body at rest. So each guard is resolved by itself.
///
/// Gaps. Affine ones are as quick as the motion: they are excluded by the Bernstein coefficients of
/// their quintic Hermite interpolant (a, ȧ, ä are known at both ends). Others only where they are
/// far (IsFar). What is not excluded is searched on the continuous extension (GuardSearch), at
/// least 4 pieces a step, 8 where the error of the motion does not limit the step, and twice as
/// many as the step before would have needed.
///
/// Forces. The stages of the step are probes that cost nothing. A force whose smallest value there
/// exceeds four times its range is excluded; else its quintic through six stages is compared with
/// four others. Where they disagree, the step is too long for the force, and must be repeated. On a
/// step that the error of the motion does not limit two more probes are made. Forces that may
/// vanish are searched like gaps.
///
/// What is found for certain, whatever a guard does elsewhere: a gap that stays closed, and a force
/// that pulls, for longer than a part of the step,
///     gap, not affine and not far    kGapExtent (1/6), kGapExtentFree (1/12) of a free step
///     force                          kForceExtent (4/15), kForceExtentFree (1/7) of a free step
/// by more than ten floors (a gap) or a twentieth of its range over the step (a force). A free step
/// is one that the error of the motion does not limit, such as polynomial motion or rest; no gap is
/// far then. Steps are at most SimulateOptions::max_step long. Guards that vary throughout the
/// step, however quickly, are found far beyond, down to the floor; and a dip counts as soon as a
/// probe sees the slope around it.
///
/// A surface may be narrow beside the step, however evenly the motion goes on: the system tells how
/// many of its widths the contact passes in a second (NarrowSurfaces). Its gap is searched with
/// kLooks pieces a width, unless it is clear of the surface, and a step that would need more than
/// GuardSearch::kMaxPieces is shortened. So a gap is found that stays closed for a quarter of a
/// width, if the contact is nowhere half as fast again as at both ends of the step.
///
/// A zero counts only if the guard falls below −floor after it, or below where the last event left
/// a gap that was lower, or if a gap that has not left its floor since it was closed comes back
/// faster than what rests: in the step, or behind it, as a gap that is below zero tells by its rate
/// and acceleration there, and a force by having come from above its floor. The floor stands for
/// what the integrator cannot resolve. Of a gap it is the absolute tolerance. Of a force it is the
/// relative tolerance of the forces in the mode, as this contact would feel them, λ_j √(G_jj/G_ii),
/// and a millionth of the pull that moves the gap by the absolute tolerance in one step,
/// 2 tolerance/(G_ii h²): no unit decides.
class EventLocator {
 public:
  static constexpr double kGapExtent = 1.0 / 6, kGapExtentFree = 1.0 / 12;
  static constexpr int kLooks = 4;  ///< pieces, in a width of a narrow surface
  static constexpr double kForceExtent = 4.0 / 15, kForceExtentFree = 1.0 / 7;

  EventLocator(ContactDynamics* dynamics, const SimulateOptions& options);
  EventLocator(const EventLocator&) = delete;
  EventLocator& operator=(const EventLocator&) = delete;

  /// From now on with a stepper that knows forces at these places; no force is known.
  void SetPlaces(const StagePlaces& places);
  /// The contact force of each field call in a mode, in the order of the calls of one step.
  void RecordForce(const Vector& force, const ContactMode& mode);
  /// The same of a stepper that calls the field in another order, and again: by StagePlaces.
  void RecordForceAt(int place, const Vector& force, const ContactMode& mode);
  /// Constraints without a guard until this is called again.
  void Ignore(const ConstraintSet& constraints) { ignored_ = constraints; }
  /// Starts an arc: no force is known.
  void BeginArc() {
    calls_ = 0;
    knows_begin_ = false;
  }
  /// Starts a step, or repeats it: only the force at its beginning is known.
  void BeginStep() {
    calls_ = calls_ > 0 ? 1 : 0;
    knows_end_ = false;
  }
  /// The gaps within their floor where an arc begins.
  ConstraintSet Low(const GapSample& begin) const;
  /// Accepts a step: the force at its end becomes the one at the beginning of the next.
  void EndStep();

  /// `begin` and `end` are the gap samples at the ends of the finished step, `free` says that the
  /// error of the motion would allow a much longer one. See LocatedEvent for a step that is too
  /// long for a guard.
  LocatedEvent Locate(Stepper* stepper, const ContactMode& mode, const GapSample& begin,
                      const GapSample& end, bool free);

  /// Adds the forces of the step that was made last, where all are known.
  void PassForces(ForceMinima* minima) const;

  /// A guard of forces at the beginning of the step, or a lower bound of it.
  double ForceAtBegin(int guard) const { return forces_(guard, 0); }

  const GuardMargins& margins() const { return margins_; }
  /// As they were before a step that was not accepted.
  void RestoreMargins(const GuardMargins& margins) { margins_ = margins; }

 private:
  void Sample(double theta, const ConstraintSet& set, double* value, double* rate);
  void SampleForces(double theta, const ConstraintSet& set, double* value);
  double AtHand(int guard) const;
  bool IsShared(int guard) const;
  ConstraintSet FallingOn(const ConstraintSet& gaps) const;
  int TurnsAtBegin() const;
  ConstraintSet OpenGaps(bool free) const;
  bool ScreenPassages(LocatedEvent* event);
  void FindForceFloors();
  bool ScreenForces(bool probed, ConstraintSet* open, LocatedEvent* pull, LocatedEvent* event);
  void StoreForce(int column, const Vector& force, const ContactMode& mode);
  void ProbeForces(int first, int count);
  void SearchGaps(const ConstraintSet& gaps, bool free, LocatedEvent* event);
  void SearchForces(ConstraintSet members, LocatedEvent* event);
  void SearchSlips(const ConstraintSet& slips, LocatedEvent* event);

  /// A step that does not resolve a force is repeated with this part of its length.
  static constexpr double kShorter = 0.3;

  ContactDynamics* dynamics_;
  const Guards guards_;
  const double floor_;  // of gaps
  const double fall_;   // the speed at which a gap comes back that has not left its floor [m/s]
  const double relative_tolerance_;
  const bool affine_;
  GuardSearch search_;
  Stepper* stepper_ = nullptr;
  ContactMode mode_;
  ConstraintSet ignored_;
  ConstraintSet rigid_;   // the members
  ConstraintSet pushes_;  // the guards that are functions of forces
  ConstraintSet slips_;   // those that are slips
  const GapSample* begin_ = nullptr;
  const GapSample* end_ = nullptr;
  const StagePlaces* places_;
  Matrix forces_;  // [guards × places]
  int calls_ = 0;
  int seen_ = 0;  // the places at which forces are known, in this step
  ConstraintTerms terms_;
  Vector x_;
  Vector floors_;  // [guards]
  Vector gain_;    // G_ii of the rows that are held [n+l+r]
  GuardMargins margins_;
  const NarrowSurfaces* narrow_ = nullptr;                     // null where no surface is
  std::vector<SurfacePassage> passages_begin_, passages_end_;  // [n]
  bool knows_begin_ = false, knows_end_ = false;               // those
  Vector looks_;  // pieces of the step that a gap asks for [n]
};

}  // namespace contact_flow
