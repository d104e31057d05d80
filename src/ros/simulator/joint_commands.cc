// SPDX-License-Identifier: BSD-3-Clause
#include "joint_commands.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/nearest_name.h"
#include "src/model/rigid_body/effort/actuator.h"
#include "src/model/rigid_body/effort/pd.h"
#include "src/model/rigid_body/effort/servo.h"
#include "src/model/rigid_body/effort/track.h"

namespace contact_flow {
namespace ros_interface {
namespace {

template <class Kind>
bool Is(const EffortElement& effort) {
  return dynamic_cast<const EffortOf<Kind>*>(&effort) != nullptr;
}

void RequireSize(const std::string& what, std::size_t size, std::size_t expected, bool optional) {
  if (size == expected || (optional && size == 0)) return;
  throw std::invalid_argument(std::to_string(size) + " " + what + ", expected " +
                              std::to_string(expected));
}

}  // namespace

JointCommands::JointCommands(const RobotSystem& robot) {
  const std::vector<std::string>& inputs = robot.description().inputs;
  for (const auto& effort : robot.robot().efforts) {
    const ElementParts& parts = effort->parts;
    if (parts.joints.empty() || parts.inputs.empty()) continue;
    const auto input = [&](std::size_t k) {
      return inputs[static_cast<std::size_t>(parts.inputs[k])];
    };
    Takers& takers =
        joints_[robot.description().coordinates[static_cast<std::size_t>(parts.joints[0].q)]];
    if (Is<effort::Pd>(*effort)) {
      takers = {input(0), input(1), input(2), 1};
    } else if (Is<effort::Servo>(*effort)) {
      takers.position = input(0);
    } else if (Is<effort::Actuator>(*effort)) {
      takers.effort = input(0);
      takers.gear = parts.numbers[0].value;
    } else if (Is<effort::Track>(*effort)) {
      takers.effort = input(0);
    }
  }
}

const JointCommands::Takers& JointCommands::Find(const std::string& joint) const {
  const auto it = joints_.find(joint);
  if (it != joints_.end()) return it->second;
  std::vector<std::string> names;
  for (const auto& entry : joints_) names.push_back(entry.first);
  throw std::invalid_argument(UnknownName("driven joint", joint, names));
}

std::string JointCommands::PositionInput(const std::string& joint) const {
  return Find(joint).position;
}
std::string JointCommands::VelocityInput(const std::string& joint) const {
  return Find(joint).velocity;
}
std::string JointCommands::EffortInput(const std::string& joint, double* gear) const {
  *gear = Find(joint).gear;
  return Find(joint).effort;
}

NamedInputs JointCommands::Inputs(const sensor_msgs::JointState& command) const {
  const std::size_t n = command.name.size();
  RequireSize("positions", command.position.size(), n, true);
  RequireSize("velocities", command.velocity.size(), n, true);
  RequireSize("efforts", command.effort.size(), n, true);
  NamedInputs inputs;
  const auto add = [&](const std::string& joint, const std::string& input, double value,
                       const char* what) {
    if (input.empty()) {
      throw std::invalid_argument("joint '" + joint + "' takes no " + what +
                                  ": its efforts are "
                                  "of another kind");
    }
    inputs.names.push_back(input);
    inputs.values.push_back(value);
  };
  for (std::size_t k = 0; k < n; ++k) {
    const std::string& joint = command.name[k];
    const Takers& takers = Find(joint);
    if (!command.position.empty()) add(joint, takers.position, command.position[k], "positions");
    if (!command.velocity.empty()) add(joint, takers.velocity, command.velocity[k], "velocities");
    if (!command.effort.empty()) {
      add(joint, takers.effort, command.effort[k] / takers.gear, "efforts");
    }
  }
  return inputs;
}

NamedInputs ToInputs(const std_msgs::Float64MultiArray& command,
                     const std::vector<std::string>& inputs) {
  const std::size_t offset = command.layout.data_offset;
  if (offset > command.data.size()) throw std::invalid_argument("data_offset is beyond the data");
  RequireSize("numbers", command.data.size() - offset, inputs.size(), false);
  return {inputs, {command.data.begin() + static_cast<std::ptrdiff_t>(offset), command.data.end()}};
}

TrajectoryFollower::TrajectoryFollower(const trajectory_msgs::JointTrajectory& trajectory,
                                       double begin, const std::vector<double>& positions,
                                       const JointCommands& commands) {
  const std::size_t n = trajectory.joint_names.size();
  if (n == 0 || trajectory.points.empty()) {
    throw std::invalid_argument("the trajectory has no joints or no points");
  }
  for (const std::string& name : trajectory.joint_names) {
    Joint joint;
    joint.position = commands.PositionInput(name);
    joint.velocity = commands.VelocityInput(name);
    joint.effort = commands.EffortInput(name, &joint.gear);
    if (joint.position.empty()) {
      throw std::invalid_argument("joint '" + name +
                                  "' takes no positions: its efforts are of "
                                  "another kind");
    }
    joints_.push_back(joint);
  }
  points_.push_back({begin, positions, {}, {}});
  double last = 0;
  for (std::size_t k = 0; k < trajectory.points.size(); ++k) {
    const trajectory_msgs::JointTrajectoryPoint& point = trajectory.points[k];
    const double after = point.time_from_start.toSec();
    if (!(after >= 0) || (k > 0 && !(after > last))) {
      throw std::invalid_argument("point " + std::to_string(k + 1) +
                                  " of the trajectory is not after the one before it");
    }
    last = after;
    RequireSize("positions in point " + std::to_string(k + 1), point.positions.size(), n, false);
    RequireSize("velocities in point " + std::to_string(k + 1), point.velocities.size(), n, true);
    RequireSize("efforts in point " + std::to_string(k + 1), point.effort.size(), n, true);
    if (k == 0 && after == 0) points_.clear();
    points_.push_back({begin + after, point.positions, point.velocities, point.effort});
  }
  // From where the joints are, without a jump of velocity unless the trajectory has none.
  if (!points_.back().velocity.empty() && points_.front().velocity.empty()) {
    points_.front().velocity.assign(n, 0);
  }
}

NamedInputs TrajectoryFollower::At(double t) const {
  const auto behind = [](double now, const Point& point) { return now < point.t; };
  const auto next = std::upper_bound(points_.begin(), points_.end(), t, behind);
  const bool before = next == points_.begin(), over = next == points_.end();
  const Point& a = before ? points_.front() : *(next - 1);
  const Point& b = before || over ? a : *next;
  const double h = b.t - a.t, s = h > 0 ? (t - a.t) / h : 0;
  const bool cubic = h > 0 && !a.velocity.empty() && !b.velocity.empty();
  NamedInputs inputs;
  const auto add = [&](const std::string& input, double value) {
    if (input.empty()) return;
    inputs.names.push_back(input);
    inputs.values.push_back(value);
  };
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const double rise = b.position[j] - a.position[j];
    double position = a.position[j] + s * rise, velocity = h > 0 ? rise / h : 0;
    if (cubic) {
      const double first = h * a.velocity[j], last = h * b.velocity[j];
      const double bend = 3 * rise - 2 * first - last, twist = first + last - 2 * rise;
      position = a.position[j] + s * (first + s * (bend + s * twist));
      velocity = (first + s * (2 * bend + s * 3 * twist)) / h;
    }
    add(joints_[j].position, position);
    add(joints_[j].velocity, velocity);
    const bool driven = !a.effort.empty() && !b.effort.empty();
    if (driven) {
      const double effort = a.effort[j] + s * (b.effort[j] - a.effort[j]);
      add(joints_[j].effort, effort / joints_[j].gear);
    }
  }
  return inputs;
}

}  // namespace ros_interface
}  // namespace contact_flow
