// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/JointState.h>

#include <optional>
#include <string>
#include <vector>

#include "contact_flow/trajectory_optimization/policy.h"

namespace contact_flow {
namespace ros_interface {

/// The state of a robot as its standard topics tell it: joints by their names, the root link of a
/// planar or floating base by its odometry, contacts by the force on each of them.
class RobotTopics {
 public:
  /// A state and the contacts that have changed since the one before.
  struct State {
    std_msgs::Header header;
    Vector x;  ///< [nq+d]
    ConstraintSet activated, released;
  };

  /// A contact touches above `threshold` [N]. Throws std::invalid_argument for rotations that are
  /// none of a base.
  RobotTopics(const PolicyNames& names, double threshold);

  /// Whether odometry is needed.
  bool has_base() const { return base_ != Base::kNone; }
  /// Joints and odometry of the same stamp are a state; joints to which none has come are one with
  /// the latest odometry when the next ones come. Throw std::invalid_argument for joints that are
  /// missing, and for quaternions that are none.
  std::optional<State> Take(const sensor_msgs::JointState& joints);
  std::optional<State> Take(const nav_msgs::Odometry& odometry);
  void Take(int constraint, const geometry_msgs::WrenchStamped& wrench);

 private:
  enum class Base { kNone, kPlanar, kFloating };
  std::optional<State> Made(const sensor_msgs::JointState& joints);
  void PutBase(Vector* x) const;

  const PolicyNames names_;
  const double threshold_;
  Base base_ = Base::kNone;
  std::size_t base_q_ = 0, base_v_ = 0;  // of its first numbers
  std::optional<sensor_msgs::JointState> waiting_;
  std::optional<nav_msgs::Odometry> odometry_;
  ConstraintSet touching_, told_;
};

}  // namespace ros_interface
}  // namespace contact_flow
