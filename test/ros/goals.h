// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>
#include <string>

#include "contact_flow/FindPeriodicOrbitAction.h"
#include "contact_flow/OptimizeOutcomeAction.h"
#include "contact_flow/OptimizeTrajectoryAction.h"
#include "test/ros/siege.h"

namespace contact_flow {
namespace fuzz {

/// An action that is given hostile goals by its topics, one after the other.
template <class ActionGoal, class ActionResult, class Request>
class GoalSender {
 public:
  GoalSender(const std::string& name, Siege* siege)
      : siege_(*siege),
        name_("/besieged/" + name),
        goal_(node_.advertise<ActionGoal>(name_ + "/goal", 10)),
        cancel_(node_.advertise<actionlib_msgs::GoalID>(name_ + "/cancel", 10)),
        result_(node_.subscribe<ActionResult>(
            name_ + "/result", 10,
            [this](const typename ActionResult::ConstPtr& result) { Take(*result); })) {}

  /// Sends one and waits for its end, which a fifth of them do not live to see.
  void Pursue(unsigned long number) {
    std::mt19937 dice(static_cast<unsigned>(number));
    MessageMutator mutator(&dice, siege_.seeds().words);
    ActionGoal goal;
    Request& request = goal.goal.request;
    siege_.seeds().Fill(&mutator, &request);
    mutator.Mutate(&request);
    Restrict(&request);
    request.options.max_seconds = kBudget;
    goal.goal_id.id = name_ + " " + std::to_string(number);
    goal.goal_id.stamp = ros::Time::now();
    siege_.Ask("goal " + goal.goal_id.id);
    {
      std::unique_lock<std::mutex> lock(mutex_);
      asked_ = goal.goal_id.id;
      goal_.publish(goal);
      if (dice() % 5 == 0) {
        actionlib_msgs::GoalID cancel = goal.goal_id;
        mutator.Mutate(&cancel);
        cancel_.publish(cancel);
      }
      told_.wait_for(lock, std::chrono::seconds(60), [this] { return asked_.empty(); });
      if (!asked_.empty()) siege_.AddWrongLocked("goal " + asked_ + " has no end");
    }
    siege_.Answered();
    ++siege_.goals_;
  }
  bool Connected() const { return goal_.getNumSubscribers() > 0 && result_.getNumPublishers() > 0; }

 private:
  static constexpr double kBudget = 0.2;  // [s]

  void Take(const ActionResult& result) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (result.status.goal_id.id != asked_) return;
    asked_.clear();
    told_.notify_all();
    if (!result.result.success && result.result.message.size() < 5 &&
        result.status.status == actionlib_msgs::GoalStatus::ABORTED) {
      siege_.AddWrongLocked("goal " + result.status.goal_id.id + " is refused without words");
    }
  }

  Siege& siege_;
  const std::string name_;
  std::mutex mutex_;
  std::condition_variable told_;
  std::string asked_;
  ros::NodeHandle node_;
  ros::Publisher goal_, cancel_;
  ros::Subscriber result_;
};

/// Goals of all actions in turn, as long as there are requests.
inline void PursueGoals(Siege* siege) {
  GoalSender<FindPeriodicOrbitActionGoal, FindPeriodicOrbitActionResult, PeriodicOrbitRequest>
      orbit("find_periodic_orbit", siege);
  GoalSender<OptimizeOutcomeActionGoal, OptimizeOutcomeActionResult, OptimizationRequest> outcome(
      "optimize", siege);
  GoalSender<OptimizeTrajectoryActionGoal, OptimizeTrajectoryActionResult, TrajectoryRequest>
      trajectory("optimize_trajectory", siege);
  for (int k = 0; k < 200; ++k) {
    if (orbit.Connected() && outcome.Connected() && trajectory.Connected()) break;
    ros::WallDuration(0.05).sleep();
  }
  for (unsigned long number = 1; siege->Requesting(); number += 3) {
    orbit.Pursue(number);
    outcome.Pursue(number + 1);
    trajectory.Pursue(number + 2);
  }
  siege->Pursued();
}

}  // namespace fuzz
}  // namespace contact_flow
