// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "contact_flow/HybridState.h"
#include "contact_flow/PolicyEvent.h"
#include "contact_flow/PolicySolve.h"
#include "contact_flow/PolicyStep.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/trajectory_optimization/receding_tracker.h"

namespace contact_flow {
namespace ros_interface {

/// What a message of the motion is answered by.
struct PolicyAnswer {
  std::vector<PolicyEvent> events;  ///< that were recognized by it
  std::vector<PolicySolve> solves;  ///< that have been decided
  std::optional<PolicyStep> step;   ///< the input from now on, if there is one
};

/// A policy in the loop with a simulator, as messages in and messages out. States and events come
/// on topics of their own, so in any order: a state is answered when the events before it have
/// come. A time that goes back begins the policy anew.
class PolicyLoop {
 public:
  /// The policy begins at `begin` [s] of the simulated time; NaN: with the first state.
  PolicyLoop(TrackingPolicy policy, const TrackerOptions& options, double begin);

  /// Throw std::invalid_argument for states and events of another model.
  PolicyAnswer Take(const HybridState& state);
  PolicyAnswer Take(const SimulatorEvent& event);
  /// A state x [nq+d] at t and the contacts that have changed since the last one: of a robot, which
  /// tells no events.
  PolicyAnswer Take(const std_msgs::Header& header, double t, const Vector& x,
                    ConstraintSet activated, ConstraintSet released);

  /// What is to be solved for a solution that begins `lead` [s] behind the state that was answered
  /// last, and when the policy had begun; nothing before it begins, where that is in the last
  /// interval of its grid, and while another solution waits for its begin.
  struct Ahead {
    HorizonTask task;          ///< since the policy began
    std::uint64_t number = 0;  ///< of the policy's beginnings
  };
  std::optional<Ahead> Task(double lead) const;
  /// What became of it. Solutions of an earlier beginning are let go.
  void Offer(HorizonSolution solution, std::uint64_t number);

  /// Begins anew with the next state.
  void Restart() { tracker_.reset(); }
  /// Whether the reference has come to its end; there are no steps any more.
  bool over() const { return over_; }
  const TrackingPolicy& policy() const { return *policy_; }  ///< that it begins with

 private:
  PolicyAnswer Answer();
  void BeginWith(const HybridState& state);
  void Begin(double t);
  void Step(const std_msgs::Header& header, double t, const Vector& x, PolicyAnswer* answer);
  void TellEvents(const std_msgs::Header& header, PolicyAnswer* answer);
  void TellSolves(const std_msgs::Header& header, PolicyAnswer* answer);

  const std::shared_ptr<const TrackingPolicy> policy_;
  const TrackerOptions options_;
  const double asked_begin_;
  std::optional<RecedingTracker> tracker_;
  std::uint64_t beginnings_ = 0;
  Vector x_;                     // that was answered last; empty: none
  double begin_ = 0, last_ = 0;  // of the simulated time [s]
  std::size_t told_ = 0;         // events of the tracker
  std::size_t told_solves_ = 0;
  std::uint64_t passed_ = 0;  // events of the simulator
  std::uint32_t epoch_ = 0;   // of the state before
  ConstraintSet mode_;        // that the robot is in
  std::deque<SimulatorEvent> events_;
  std::optional<HybridState> waiting_;
  int waits_ = 0;  // states that have come while one waits
  bool over_ = false;
};

}  // namespace ros_interface
}  // namespace contact_flow
