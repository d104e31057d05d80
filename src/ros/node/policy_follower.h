// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "horizon_parameters.h"
#include "src/ros/policy/horizon_solver.h"
#include "src/ros/policy/policy_loop.h"
#include "src/ros/policy/robot_topics.h"

namespace contact_flow {
namespace ros_interface {

/// The private parameters of policy_tracker.
struct FollowerParameters {
  std::string file;                     ///< ~file: a policy in YAML; or …
  std::string source;                   ///< … ~source: the node whose ~policy is followed
  std::string simulator = "simulator";  ///< ~simulator: whose topics are read and written
  /// ~begin of the policy, of the simulated time [s]; NaN: with the first state
  double begin = std::numeric_limits<double>::quiet_NaN();
  TrackerOptions tracker;  ///< ~extend, ~on_time, ~patience
  /// ~states: "simulator" by HybridState and SimulatorEvent, or "robot" by RobotTopics
  int states = 0;
  double touch_force = 5;  ///< ~touch_force above which a contact of a robot touches [N]
  /// ~commands: "input" InputCommand, "commands" Float64MultiArray, "joint_commands" JointState
  int commands = 0;
  std::vector<std::string> joints;  ///< ~joints of joint_commands, one an input
  int quantity = 0;                 ///< ~joint_quantity: "effort", "position" or "velocity"
  bool lockstep = false;            ///< ~lockstep: steps a paused simulator by its services
  double period = 1e-3;             ///< ~period of these steps [s]
  std::optional<HorizonParameters> horizon;  ///< ~horizon: solves again as it goes
};

/// Throws std::invalid_argument, naming the parameter, for one that is not in order.
FollowerParameters ReadFollowerParameters();

/// Follows a policy: answers each state of the simulator by an input, and tells ~steps and the
/// recognized ~tracked_events. A robot's policy begins with the state behind a call of ~start.
class PolicyFollower {
 public:
  /// Throws std::invalid_argument where the policy and the parameters do not fit.
  PolicyFollower(const FollowerParameters& parameters, TrackingPolicy policy);

  /// Follows until it is told to stop. Throws std::runtime_error when a service of the simulator
  /// refuses, in lockstep.
  void Run();

 private:
  /// Tells, and outside lockstep commands, what a message is answered by.
  template <class Message>
  void Take(const Message& message);
  void Give(const PolicyAnswer& answer);
  void Command(const PolicyStep& step);
  void ListenToSimulator();
  void ListenToRobot();
  bool Start(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& out);
  void Follow(const std::optional<RobotTopics::State>& state);
  void TakeSolved();
  void Solve(double t);
  void RunInLockstep();

  const FollowerParameters parameters_;
  PolicyLoop loop_;
  ros::NodeHandle node_, private_;
  ros::Publisher steps_, tracked_events_, solves_, command_;
  ros::ServiceServer start_;
  std::vector<ros::Subscriber> subscribers_;
  std::optional<RobotTopics> robot_;
  bool started_ = false;
  std::optional<PolicyStep> step_;  // that answers the last message
  // Since the policy began [s]: of the last state that was answered, and of the last task.
  double now_ = 0, last_solve_ = -std::numeric_limits<double>::infinity(), begin_ = 0;
  std::unique_ptr<HorizonSolver> solver_;  // ends first
  bool said_over_ = false;
};

/// Reads the parameters and the policy, and follows it. Returns the exit code of the process: 1
/// with a message when something is not in order.
int RunPolicyFollower();

}  // namespace ros_interface
}  // namespace contact_flow
