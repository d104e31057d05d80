// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sensor_msgs/JointState.h>
#include <std_msgs/Float64MultiArray.h>
#include <trajectory_msgs/JointTrajectory.h>

#include <map>
#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/robot_system.h"

namespace contact_flow {
namespace ros_interface {

/// Inputs by name.
struct NamedInputs {
  std::vector<std::string> names;
  std::vector<double> values;
};

/// What commands to joints are as inputs of a robot, by its efforts at them:
///
///   command    pd             servo    actuator       track
///   position   position       input    –              –
///   velocity   velocity       –        –              –
///   effort     feed_forward   –        gear · input   feed_forward
///
/// Throws std::invalid_argument for a joint, or a command to it, that no effort takes.
class JointCommands {
 public:
  explicit JointCommands(const RobotSystem& robot);

  /// Positions, velocities and efforts; each may be empty.
  NamedInputs Inputs(const sensor_msgs::JointState& command) const;
  /// A joint's input of a position or a velocity; "" where there is none.
  std::string PositionInput(const std::string& joint) const;
  std::string VelocityInput(const std::string& joint) const;
  std::string EffortInput(const std::string& joint, double* gear) const;

 private:
  struct Takers {
    std::string position, velocity, effort;
    double gear = 1;
  };
  const Takers& Find(const std::string& joint) const;

  std::map<std::string, Takers> joints_;
};

/// All inputs in the order of the model. Throws std::invalid_argument for another number of them.
NamedInputs ToInputs(const std_msgs::Float64MultiArray& command,
                     const std::vector<std::string>& inputs);

/// A JointTrajectory on its way: between points positions go straight or, where the points have
/// velocities, along the cubic with these at its ends; velocities are those of that motion, and
/// efforts go straight. Before its first point it comes from where the joints are when it begins;
/// behind the last one it holds, at rest.
class TrajectoryFollower {
 public:
  /// `begin` [s] is when time_from_start is zero; `positions` of the joints are those now. Throws
  /// std::invalid_argument where points are missing, of wrong size or not in the order of time,
  /// and for joints that take no positions.
  TrajectoryFollower(const trajectory_msgs::JointTrajectory& trajectory, double begin,
                     const std::vector<double>& positions, const JointCommands& commands);

  /// The inputs at t.
  NamedInputs At(double t) const;
  /// Whether nothing changes any more behind t.
  bool Done(double t) const { return t >= points_.back().t; }

 private:
  struct Point {
    double t;
    std::vector<double> position, velocity, effort;  // the latter may be empty
  };
  struct Joint {
    std::string position, velocity, effort;  // inputs
    double gear = 1;
  };

  std::vector<Joint> joints_;
  std::vector<Point> points_;  // the first is the beginning
};

}  // namespace ros_interface
}  // namespace contact_flow
