// SPDX-License-Identifier: BSD-3-Clause
#include "policy_follower.h"

#include <ros/callback_queue.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/Float64MultiArray.h>

#include <stdexcept>
#include <utility>

#include "contact_flow/GetSimulatorState.h"
#include "contact_flow/InputCommand.h"
#include "contact_flow/SetInput.h"
#include "contact_flow/StepSimulation.h"
#include "contact_flow/io/map_reader.h"
#include "contact_flow/io/policy_file.h"
#include "parameters.h"
#include "src/ros/display/display.h"
#include "src/ros/message/gate.h"
#include "src/ros/request/policy_messages.h"

namespace contact_flow {
namespace ros_interface {
namespace {

enum Commands { kInput, kNumbers, kJoints };
enum States { kSimulator, kRobot };

constexpr double kRounding = 1e-9;  // of simulated times [s]

void ReadTime(MapReader* reader, const std::string& key, double smallest, double largest,
              double* value) {
  reader->Read(key, value);
  if (reader->Has(key)) {
    CheckWithin(ros::this_node::getName() + "/" + key, *value, smallest, largest);
  }
}

/// Calls a service over its persistent connection; throws with what it answers when it refuses.
template <class Service>
void Ask(ros::ServiceClient* client, Service* call) {
  if (!client->call(*call)) {
    throw std::runtime_error(client->getService() + " does not answer");
  }
  if (!call->response.success) {
    throw std::runtime_error(client->getService() + ": " + call->response.message);
  }
}

}  // namespace

FollowerParameters ReadFollowerParameters() {
  FollowerParameters p;
  const std::string name = ros::this_node::getName();
  MapReader reader(PrivateParameters(), name);
  reader.Read("file", &p.file);
  reader.Read("source", &p.source);
  if (p.file.empty() == p.source.empty()) {
    throw std::invalid_argument(name + "/file is '" + p.file + "' and " + name + "/source is '" +
                                p.source + "', expected one of them");
  }
  reader.Read("simulator", &p.simulator);
  ReadTime(&reader, "begin", -1e9, 1e9, &p.begin);
  reader.Read("extend", &p.tracker.extend);
  ReadTime(&reader, "on_time", 0, 1e6, &p.tracker.on_time);
  ReadTime(&reader, "patience", 0, 1e6, &p.tracker.patience);
  reader.Read("states", {"simulator", "robot"}, &p.states);
  ReadTime(&reader, "touch_force", 0, 1e9, &p.touch_force);
  reader.Read("commands", {"input", "commands", "joint_commands"}, &p.commands);
  reader.Read("joints", &p.joints);
  reader.Read("joint_quantity", {"effort", "position", "velocity"}, &p.quantity);
  reader.Read("lockstep", &p.lockstep);
  ReadTime(&reader, "period", 1e-6, 10, &p.period);
  if (reader.Has("horizon")) p.horizon = ReadHorizonParameters(reader.Child("horizon"), name);
  reader.Finish();
  if (p.lockstep && p.states == kRobot) {
    throw std::invalid_argument(name + "/lockstep is true, expected false where states is robot");
  }
  return p;
}

PolicyFollower::PolicyFollower(const FollowerParameters& parameters, TrackingPolicy policy)
    : parameters_(parameters),
      loop_(std::move(policy), parameters.tracker,
            parameters.states == kRobot ? std::numeric_limits<double>::quiet_NaN()
                                        : parameters.begin),
      private_("~") {
  const std::size_t inputs = loop_.policy().names.inputs.size();
  if (parameters.commands == kJoints && parameters.joints.size() != inputs) {
    throw std::invalid_argument("joints has " + std::to_string(parameters.joints.size()) +
                                " entries, expected " + std::to_string(inputs) +
                                ", one for each input of the policy");
  }
  if (parameters.horizon) {
    solver_ = MakeSolver(*parameters.horizon, loop_.policy(), parameters.lockstep);
    solves_ = private_.advertise<PolicySolve>("solves", 1000);
  }
  steps_ = private_.advertise<PolicyStep>("steps", 1000);
  tracked_events_ = private_.advertise<PolicyEvent>("tracked_events", 1000, true);
  const std::string of = parameters.simulator + "/";
  if (!parameters.lockstep) {
    if (parameters.commands == kInput) command_ = node_.advertise<InputCommand>(of + "input", 10);
    if (parameters.commands == kNumbers) {
      command_ = node_.advertise<std_msgs::Float64MultiArray>(of + "commands", 10);
    }
    if (parameters.commands == kJoints) {
      command_ = node_.advertise<sensor_msgs::JointState>(of + "joint_commands", 10);
    }
  }
  if (parameters.states == kRobot) {
    ListenToRobot();
  } else {
    ListenToSimulator();
  }
}

void PolicyFollower::ListenToSimulator() {
  const std::string of = parameters_.simulator + "/";
  const ros::TransportHints quick = ros::TransportHints().tcpNoDelay();
  subscribers_.push_back(node_.subscribe<SimulatorEvent>(
      of + "events", 1000, [this](const SimulatorEvent::ConstPtr& event) { Take(*event); },
      ros::VoidConstPtr(), quick));
  if (parameters_.lockstep) return;
  subscribers_.push_back(node_.subscribe<HybridState>(
      of + "state", 1000, [this](const HybridState::ConstPtr& state) { Take(*state); },
      ros::VoidConstPtr(), quick));
}

void PolicyFollower::ListenToRobot() {
  const PolicyNames& names = loop_.policy().names;
  const ros::TransportHints quick = ros::TransportHints().tcpNoDelay();
  robot_.emplace(names, parameters_.touch_force);
  start_ = private_.advertiseService("start", &PolicyFollower::Start, this);
  const auto guarded = [](const auto& body) {
    try {
      body();
    } catch (const std::exception& error) {
      ROS_ERROR_THROTTLE(1, "policy_tracker: %s", error.what());
    }
  };
  subscribers_.push_back(node_.subscribe<sensor_msgs::JointState>(
      "joint_states", 1000,
      [=](const sensor_msgs::JointState::ConstPtr& m) {
        guarded([&] { Follow(robot_->Take(*m)); });
      },
      ros::VoidConstPtr(), quick));
  if (robot_->has_base()) {
    subscribers_.push_back(node_.subscribe<nav_msgs::Odometry>(
        "odom", 1000,
        [=](const nav_msgs::Odometry::ConstPtr& m) { guarded([&] { Follow(robot_->Take(*m)); }); },
        ros::VoidConstPtr(), quick));
  }
  for (std::size_t i = 0; i < names.constraints.size(); ++i) {
    subscribers_.push_back(node_.subscribe<geometry_msgs::WrenchStamped>(
        parameters_.simulator + "/wrench/" + TopicName(names.constraints[i]), 1000,
        [=](const geometry_msgs::WrenchStamped::ConstPtr& m) {
          guarded([&] { robot_->Take(static_cast<int>(i), *m); });
        },
        ros::VoidConstPtr(), quick));
  }
}

bool PolicyFollower::Start(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& out) {
  loop_.Restart();
  started_ = true;
  out.success = true;
  out.message = "the policy begins with the next state";
  return true;
}

/// In lockstep a solution is taken, and waited for, before the state at which it begins, so that
/// nothing depends on its speed.
void PolicyFollower::TakeSolved() {
  if (!solver_) return;
  std::optional<HorizonSolver::Solved> solved;
  if (!parameters_.lockstep) {
    solved = solver_->Take();
  } else if (now_ + 1.5 * parameters_.period >= begin_) {
    solved = solver_->Wait();
  }
  if (solved) loop_.Offer(std::move(solved->solution), solved->number);
}

void PolicyFollower::Solve(double t) {
  now_ = t;
  if (!solver_ || !solver_->idle()) return;
  if (t < last_solve_) last_solve_ = -std::numeric_limits<double>::infinity();  // it began anew
  if (t < last_solve_ + parameters_.horizon->every - kRounding) return;
  const std::optional<PolicyLoop::Ahead> ahead = loop_.Task(parameters_.horizon->lead);
  if (!ahead) return;
  last_solve_ = t;
  begin_ = ahead->task.begin;
  solver_->Post(*ahead);
}

void PolicyFollower::Follow(const std::optional<RobotTopics::State>& state) {
  if (!state || !started_) return;
  TakeSolved();
  Give(loop_.Take(state->header, state->header.stamp.toSec(), state->x, state->activated,
                  state->released));
}

template <class Message>
void PolicyFollower::Take(const Message& message) {
  try {
    TakeSolved();
    Give(loop_.Take(message));
  } catch (const std::exception& error) {
    if (parameters_.lockstep) throw;
    ROS_ERROR_THROTTLE(1, "policy_tracker: %s", error.what());
  }
}

void PolicyFollower::Give(const PolicyAnswer& answer) {
  for (const PolicyEvent& event : answer.events) tracked_events_.publish(event);
  for (const PolicySolve& solve : answer.solves) solves_.publish(solve);
  if (answer.step) steps_.publish(*answer.step);
  if (answer.step && !parameters_.lockstep) Command(*answer.step);
  if (answer.step) Solve(answer.step->t);
  step_ = answer.step;
  if (loop_.over() && !said_over_) ROS_INFO("policy_tracker: the reference has come to its end");
  said_over_ = loop_.over();
}

void PolicyFollower::Command(const PolicyStep& step) {
  if (parameters_.commands == kInput) {
    InputCommand command;
    command.names = loop_.policy().names.inputs;
    command.values = step.input;
    command_.publish(command);
  } else if (parameters_.commands == kNumbers) {
    std_msgs::Float64MultiArray command;
    command.data = step.input;
    command_.publish(command);
  } else {
    sensor_msgs::JointState command;
    command.name = parameters_.joints;
    (parameters_.quantity == 0   ? command.effort
     : parameters_.quantity == 1 ? command.position
                                 : command.velocity) = step.input;
    command_.publish(command);
  }
}

void PolicyFollower::Run() {
  if (parameters_.lockstep) {
    RunInLockstep();
  } else {
    ros::spin();
  }
}

/// State, input, step: nothing depends on the speed of either.
void PolicyFollower::RunInLockstep() {
  const std::string of = parameters_.simulator + "/";
  for (const char* service : {"get_state", "set_input", "step"}) {
    if (!ros::service::waitForService(of + service)) return;
  }
  constexpr bool kPersistent = true;
  auto get_state = node_.serviceClient<GetSimulatorState>(of + "get_state", kPersistent);
  auto set_input = node_.serviceClient<SetInput>(of + "set_input", kPersistent);
  auto step = node_.serviceClient<StepSimulation>(of + "step", kPersistent);
  // Events before the topic is heard would be missed.
  while (ros::ok() && subscribers_.front().getNumPublishers() == 0) ros::WallDuration(0.01).sleep();
  while (ros::ok()) {
    GetSimulatorState now;
    Ask(&get_state, &now);
    const HybridState& state = now.response.state;
    Take(state);
    while (ros::ok() && !step_ && !loop_.over() && !(state.t < parameters_.begin)) {
      ros::getGlobalCallbackQueue()->callAvailable(ros::WallDuration(0.01));  // events on their way
    }
    if (loop_.over()) break;
    if (step_) {
      SetInput input;
      input.request.names = loop_.policy().names.inputs;
      input.request.values = step_->input;
      Ask(&set_input, &input);
    }
    StepSimulation further;
    further.request.seconds = parameters_.period;
    Ask(&step, &further);
  }
  ros::spin();  // who comes late still hears what was latched
}

int RunPolicyFollower() {
  const ros::NodeHandle handle;  // ROS, and its log, outlive what may throw
  try {
    const FollowerParameters parameters = ReadFollowerParameters();
    if (!parameters.file.empty()) {
      PolicyFollower(parameters, ReadPolicyFile(parameters.file)).Run();
      return 0;
    }
    const auto policy = ros::topic::waitForMessage<Policy>(parameters.source + "/policy");
    if (!policy) return 0;  // stopped meanwhile
    PolicyFollower(parameters, FromMsg(*policy)).Run();
    return 0;
  } catch (const std::exception& error) {
    ROS_FATAL("policy_tracker: %s", error.what());
    return 1;
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
