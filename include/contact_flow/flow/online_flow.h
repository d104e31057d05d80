// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <memory>

#include "contact_flow/flow/flow.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// A run that goes along with a clock: it is asked for ever later instants and told
/// inputs on the way.
///
/// The integrator takes the same steps as in Simulate, ahead of `now`; instants in between are read
/// from the step's continuous extension and never cut a step. An input does, at its time. So the
/// events, and the states at all instants, are to the bit those of one call
///
///   Simulate(system, x, {grid, values}, duration, options),   grid[0] = t₀,  State(t),
///
/// with the times and values of the inputs as its schedule and any duration beyond the last step,
/// whatever the instants at which this one was looked at.
///
/// The budgets of SimulateOptions do not end it; memory does not grow.
class OnlineFlow {
 public:
  /// Begins at t [s]. Throws std::invalid_argument for options, sizes and states that
  /// Simulate refuses.
  OnlineFlow(std::shared_ptr<const MechanicalSystem> system, double t, const VectorRef& x,
             const VectorRef& u, const SimulateOptions& options);

  /// The system that flows.
  const MechanicalSystem& system() const { return *system_; }
  double now() const { return now_; }  ///< [s]
  /// Not kOk: the run has ended at now(), and the message says why.
  const Status& status() const { return flow_.status(); }
  /// The first Trajectory::kMaxWarnings, in the order of time, and how many there were: grazings
  /// and the like, which the run passed.
  const std::vector<Warning>& warnings() const { return flow_.warnings(); }
  /// How many warnings there were.
  long num_warnings() const { return flow_.num_warnings(); }

  /// Moves now() on to t, or to the first transition before or at t: then true, and it is
  /// transition(). An input that changes is one. Ends earlier when the run does.
  /// Where a Budget ends it throws BudgetExceeded, and now() is the end of the last step that was
  /// made: a later call goes on from there, to the bit as if there had been none.
  bool AdvanceTo(double t);
  /// The transition that was passed last.
  const Transition& transition() const { return flow_.transition(); }

  /// The input from t ≥ now() on, until the next. A later call for the same t takes its place.
  /// Throws std::invalid_argument for sizes and non-finite numbers.
  void SetInput(double t, const VectorRef& u);

  /// Makes now() the end of a step, as an input at now() would: for what starts from State() then.
  void Settle();

  /// At now(): right limits.
  Vector State();  ///< x [nq+d]
  /// Contact mode J of now.
  ContactMode mode() const { return flow_.mode(); }
  /// The input that holds at now(), and that from now() on.
  const Vector& u() const { return flow_.u(); }
  /// The input from now() on.
  const Vector& NextInput() const;
  /// An input from t [s] on.
  struct Input {
    double t;  ///< from this instant on [s]
    Vector u;  ///< [m]
  };
  /// Those told for now() or later, in the order of time.
  const std::deque<Input>& inputs_to_come() const { return inputs_; }

  /// Of what lies behind.
  Margins margins() const { return flow_.margins(); }
  /// Counts of the work.
  RunStatistics statistics() const { return flow_.statistics(); }

  /// From now on, the motion is kept for Motion(), back to the last Forget().
  void KeepMotion(bool keep);
  /// The motion up to now() in the arc that holds now(), or that has ended there by transition() if
  /// that is where AdvanceTo stopped; it begins with the arc, or with a step that holds the instant
  /// of the last Forget().
  Arc Motion();
  /// Lets go of what lies behind.
  void Forget() { Forget(now_); }
  void Forget(double t);  ///< the motion after t ≤ now() in the present arc is kept

 private:
  bool Advance(double t);
  bool Propose();
  /// Accepts the proposal up to `end`; true when a transition was passed.
  bool Accept(double end);
  void BeginMotion();

  const std::shared_ptr<const MechanicalSystem> system_;
  Flow flow_;
  double now_;
  bool proposed_ = false;     // a step from the node lies ahead
  std::deque<Input> inputs_;  // to come, in the order of time
  bool keep_ = false;
  bool arc_ended_ = false;  // motion_ is of the arc before transition()
  Arc motion_;              // accepted steps
};

}  // namespace contact_flow
