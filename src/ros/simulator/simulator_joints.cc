// SPDX-License-Identifier: BSD-3-Clause
// Commands to joints by standard messages.
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "simulator.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {

JointCommands Simulator::Joints() const {
  const RobotSystem* robot = session_.setup()->robot;
  if (robot == nullptr) {
    throw std::invalid_argument(
        "the simulation is of a model, which has no joints: use ~input or "
        "~commands");
  }
  return JointCommands(*robot);
}

void Simulator::TakeJoints(const sensor_msgs::JointState& command) {
  Post([this, command] {
    try {
      CheckMessage(command);
      const NamedInputs inputs = Joints().Inputs(command);
      session_.SetInput(TimeOf(command.header.stamp), inputs.names, inputs.values);
    } catch (const std::exception& error) {
      ROS_WARN_THROTTLE(1, "joint_commands: %s", error.what());
    }
  });
}

void Simulator::TakeNumbers(const std_msgs::Float64MultiArray& command) {
  Post([this, command] {
    try {
      CheckMessage(command);
      const NamedInputs inputs = ToInputs(command, session_.setup()->system->description().inputs);
      session_.SetInput(session_.now(), inputs.names, inputs.values);
    } catch (const std::exception& error) {
      ROS_WARN_THROTTLE(1, "commands: %s", error.what());
    }
  });
}

void Simulator::TakeTrajectory(const trajectory_msgs::JointTrajectory& trajectory) {
  Post([this, trajectory] {
    try {
      CheckMessage(trajectory);
      if (trajectory.points.empty()) {
        trajectory_.reset();
        return;
      }
      const JointCommands joints = Joints();
      const RobotModel& model = session_.setup()->robot->robot().model;
      const Vector x = session_.State();
      std::vector<double> positions;
      for (const std::string& joint : trajectory.joint_names) {
        positions.push_back(x(model.FindCoordinate(joint).q));
      }
      const double begin = TimeOf(trajectory.header.stamp);
      TrajectoryFollower follower(trajectory, begin, positions, joints);
      const NamedInputs inputs = follower.At(session_.now());
      session_.SetInput(session_.now(), inputs.names, inputs.values);
      trajectory_.emplace(std::move(follower));  // one that is refused changes nothing
      control_tick_ = -1;
      FollowTrajectory();
    } catch (const std::exception& error) {
      ROS_WARN_THROTTLE(1, "joint_trajectory: %s", error.what());
    }
  });
}

/// One instant ahead, so that who repeats the recording knows of an input before its time, too.
void Simulator::FollowTrajectory() {
  if (!trajectory_) return;
  const double rate = parameters_.control_rate;
  const long tick = static_cast<long>(std::floor(session_.now() * rate + 1e-6));
  if (tick <= control_tick_) return;
  control_tick_ = tick;
  const double next = static_cast<double>(tick + 1) / rate;
  const NamedInputs inputs = trajectory_->At(next);
  if (trajectory_->Done(next)) trajectory_.reset();
  session_.SetInput(next, inputs.names, inputs.values);
}

}  // namespace ros_interface
}  // namespace contact_flow
