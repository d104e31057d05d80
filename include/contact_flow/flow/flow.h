// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/closed_gaps.h"
#include "contact_flow/flow/corner_locator.h"
#include "contact_flow/flow/dop853.h"
#include "contact_flow/flow/error_tally.h"
#include "contact_flow/flow/event_locator.h"
#include "contact_flow/flow/implied_gaps.h"
#include "contact_flow/flow/radau.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/stopped_gaps.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/flow/transition.h"
#include "contact_flow/flow/zeno_detector.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The hybrid flow of Def. 1 as it unfolds, one step at a time, from node to node: a node is a time
/// with its state, contact mode and input.
///
///   Propose()       integrates from the node as far as the error control lets one step reach, or
///   to the first event
///                   in it; each call starts from the node again.
///   Accept()        makes the end of the proposal the next node; an event there is passed.
///   Cut(t)          makes an instant inside the proposal the next node, by a step up to there.
///   ChangeInput(u)  at a node.
///
/// Causality: a proposal does not know of the cut that may follow, and its continuous extension
/// holds up to there all the same. So the motion up to t does not depend, to the bit, on what is
/// decided for later than t. Simulate cuts at the instants of its input grid, an OnlineFlow at
/// those of its commands: the same inputs give the same bits.
///
/// Memory does not grow. `system` must outlive the flow.
class Flow {
 public:
  /// From the node (t, x, mode, u); x is put on the state manifold.
  Flow(const MechanicalSystem& system, double t, const VectorRef& x, ContactMode mode,
       const VectorRef& u, const SimulateOptions& options);
  Flow(const Flow&) = delete;
  Flow& operator=(const Flow&) = delete;

  double t() const { return t_; }         ///< [s]
  const Vector& x() const { return x_; }  ///< right limit [nq+d]
  ContactMode mode() const { return mode_; }
  const Vector& u() const { return dynamics_.u(); }
  /// Not kOk: the run is over, at t().
  const Status& status() const { return status_; }

  /// Proposes a step that ends at `end` > t() [s] at the latest, a horizon; false when
  /// the run is over.
  bool Propose(double end = std::numeric_limits<double>::infinity());
  double proposed_end() const { return end_; }             ///< [s]
  const Vector& proposed_state() const { return x_end_; }  ///< left limit there [nq+d]
  bool proposes_event() const { return trigger_ >= 0; }
  /// Length of the proposal's continuous extension [s]; may be 0.
  double proposed_length() const { return jam_ ? 0 : stepper_->step(); }
  /// Whether the implicit method made it.
  bool ProposesImplicit() const { return stepper_ == implicit_.get(); }
  /// Its coefficients [kDenseOrder × nq+d], see EvaluateDenseStep.
  const double* ProposedDense();

  /// Goes on to the end of the proposal; true when a transition was passed there, which
  /// transition() holds. The status tells whether the run goes on.
  bool Accept();
  /// Goes on to t() < t < proposed_end() only, by a step of that length from the node: its error is
  /// less than the proposal's. False when the run is over.
  bool Cut(double t);
  /// A slip in the plane that vanishes at the node, as far as it is known, ends there. True when
  /// one did; transition() then holds it. Where the input changes next, it might hide the end.
  bool EndSlips();
  /// The next input begins: what rests stays in contact unless it would have to pull now. True when
  /// the run goes on; transition() then holds the change.
  bool ChangeInput(const VectorRef& u);
  /// The run is over, for this reason.
  void Stop(Outcome outcome, const std::string& reason);
  const Transition& transition() const { return transition_; }

  /// Of what was accepted.
  Margins margins() const;
  RunStatistics statistics() const;
  /// Estimated local errors of the steps accepted in the present arc, or in the one that has ended
  /// where the last transition was passed, as a tangent [2d]; see Arc::error.
  const Vector& arc_error() const { return arc_error_.error(); }
  /// See Trajectory.
  double accumulation_time() const { return accumulation_time_; }
  /// The first Trajectory::kMaxWarnings of those met so far.
  const std::vector<Warning>& warnings() const { return warnings_; }
  long num_warnings() const { return num_warnings_; }

 private:
  void Field(const double* x, double* xdot);
  void FieldAt(int place, const double* x, double* xdot);
  void SampleEnd(GapSample* sample);
  void FinishStep();
  bool Drifts(const Vector& x, const GapSample& sample) const;
  double SlowDrift() const;
  double HeldMisfit();
  int HeldApart();
  bool TakesOtherWord(const ResolvedTransition& resolved);
  bool ClockIsDue() const;
  double ReadClock();
  bool WithinBudget();
  const char* StiffHint() const;
  void BeginArc();
  /// Stops where a gap has become negative: an event was missed, whatever the reason.
  bool Penetrates();
  bool Attempt(double end, double* h, bool* rejected);
  std::optional<double> StepOntoEvent(const LocatedEvent& event, double length);
  std::optional<double> StepOntoLevel(const LocatedEvent& event, double length, double s,
                                      double level);
  std::optional<double> LevelOfReturn(int i, const GuardJet& begin, double reached, double length);
  GuardJet GapAtEnd(int i);
  double StepOntoCorner(double error, double* length);
  double Retry(double length);
  double NewtonOntoCorner(const CornerLocator::Zero& zero, double s, double* length);
  double StepBehindCorner(double h);
  double TimeToKnot() const;
  bool PassTransition();
  TransitionRules Rules() const;
  bool GoesOn();
  std::optional<double> Accumulation(const ResolvedTransition& resolved);
  std::optional<double> PredictRest(int i);
  bool Touch(ConstraintSet contacts);
  ConstraintSet EndOfBounces();
  bool CompleteZeno(ConstraintSet sticking);
  void Warn(Outcome code, const std::string& message);
  /// Where an arc begins whose forces are not unique, once for the contacts that share them.
  void WarnOfSharedForces();
  /// No step size is small enough: why.
  void StopWithoutSteps();
  void FindImplied();
  void BeginAtRest();
  int ImpliedThatMoved(double reaches) const;
  void ForgetRisen();
  double SlipInSpaceLimit() const;
  bool OutgrowsTurn() const;
  int StoppedInSpace();
  bool EndSlipAtNode();
  void NoteSlipRegularity();
  bool CrossesSingularSlip(double length) const;
  bool LosesLoop();
  ResolvedTransition ResolveAtEvent();
  bool WouldStick(int i);
  ConstraintSet SlidingInSpace() const;
  void TallyStep();
  void NoteForces();
  void NoteCutStep(double error);
  void FollowStopped();
  void NoteHeldDown();
  bool CrowdsAgain() const;
  void CountCrowd(const Transition& next);
  void SettleCrowd(ResolvedTransition* resolved);
  void TallyTransition();
  void NoteUnresolvedReturn(int i, double gap, double rate);
  ConstraintSet LowAtBegin() const;
  bool StandsNear(int i) const;
  int ThrownDown() const;
  void RememberTouched();
  void NoteGrazes(bool stepped);
  bool Grazes(int i, bool stepped, double floor, double noise, double rounding) const;
  void NoteGraze(int i);
  void MakeImplicit();
  void ConsiderMethod();
  void ChangeMethod(Stepper* stepper);
  void MeetTurns();

  /// Up to `end` [s] no step is longer than `step` [s]: a guard was seen there that is quicker.
  struct QuickGuard {
    double end = -std::numeric_limits<double>::infinity();
    double step = std::numeric_limits<double>::infinity();
  };

  /// Where steps lead to the passing of a corner.
  struct CornerApproach {
    double end = std::numeric_limits<double>::quiet_NaN();  ///< of the step before the last [s]
    double rest = 0;    ///< from the end of the proposal to the passing [s]; 0: none is ahead
    double whole = 0;   ///< length of the steps before they were cut [s]
    bool onto = false;  ///< the proposal ends at it
  };

  const MechanicalSystem& system_;
  const SimulateOptions options_;
  const bool on_manifold_;
  ContactDynamics dynamics_;
  const Guards guards_;
  EventLocator locator_;
  CornerLocator corners_;
  ZenoDetector zeno_;
  Dop853 explicit_;
  std::unique_ptr<Radau> implicit_;
  Stepper* stepper_;

  // The node.
  double t_;
  Vector x_;
  ContactMode mode_;
  bool arc_begun_ = false;
  double h_ = 0;  // the step that the error control suggests
  GapSample gaps_begin_;
  bool drifts_ = false;      // contacts have left their surfaces by more than they may
  double regular_slip_ = 0;  // where the step begins, see ContactDynamics::slip_regularity
  double held_reach_ = 1;    // of what dependent rows may drift to
  Vector loop_size_;         // the longest that each bilateral row has been [l]
  GuardMargins guard_margins_;
  ForceMinima force_minima_{guards_.size()};
  StoppedGaps stopped_gaps_{options_};
  QuickGuard quick_;
  Status status_;

  // The proposal.
  double end_ = 0;
  double h_next_ = 0;
  CornerApproach approach_;
  QuickGuard quick_next_;
  int too_quick_ = -1;  // the guard that the last attempt did not resolve
  int trigger_ = -1;
  std::optional<ResolvedTransition> jam_;  // where a slip ends at the node itself
  double regular_end_ = 0;                 // as regular_slip_, where the proposal ends
  bool singular_slip_ = false;             // it ends where a slip becomes singular
  int thrown_ = -1;  // a contact that is hit where the arc begins, and turns back within its floor
  double misfit_ = 0;    // what it leaves of rates that are held, in what they may drift to
  ConstraintSet apart_;  // contacts held on dependent rows that it moves apart; it ends there
  Vector x_end_;
  GapSample gaps_end_;

  ErrorTally arc_error_;    // since the arc began
  ErrorTally start_error_;  // of the arc before, where this one begins
  double arc_begin_ = 0;    // [s]
  ClosedGaps closed_{system_.num_constraints()};
  bool new_arc_ = false;  // the next step is the first of its arc

  Transition transition_;
  std::optional<double> last_transition_;
  Margins margins_;
  double accumulation_time_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<Warning> warnings_;
  long num_warnings_ = 0;
  ConstraintSet shared_, springs_;  // warned of
  ConstraintSet held_down_;         // by transitions: they would be up until then
  double held_until_ = 0;           // [s]
  ImpliedGaps implied_;     // touching constraints that mode_ implies: no guards on this arc
  int stalls_ = 0;          // transitions in a row without time between them
  int idle_ = 0;            // the same, of those that change nothing
  int crowd_ = 0;           // the same, while what they change hardly moves
  int settles_ = 0;         // how often such were ended in a row
  double crowd_moved_ = 0;  // by a crowd [m]
  double settled_ = -std::numeric_limits<double>::infinity();  // the last time [s]
  int last_trigger_ = -1;
  long attempts_ = 0, steps_ = 0, transitions_ = 0;
  long implicit_steps_ = 0;
  int for_change_ = 0, against_change_ = 0;  // steps that speak for the other method, and not
  static constexpr double kAtOnce = 0;
  double next_clock_reading_;  // by the coarse clock [s]
  double deadline_ = 0;        // set at the first reading
  ConstraintTerms terms_;
};

}  // namespace contact_flow
