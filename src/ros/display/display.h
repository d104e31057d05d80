// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/SimulatorStatus.h"
#include "point_display.h"
#include "robot_display.h"
#include "src/session/instant.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// What the simulator shows of a state to ROS tools: a function of setup, state and stamp alone, so
/// that verify_bag can repeat it.
class Display {
 public:
  Display(std::shared_ptr<const Setup> setup, const DisplayOptions& options);

  struct OfState {
    sensor_msgs::JointState joints;
    tf2_msgs::TFMessage transforms;
    visualization_msgs::MarkerArray contacts;
    std::vector<geometry_msgs::WrenchStamped> wrenches;       ///< one a constraint [n]
    std::vector<geometry_msgs::WrenchStamped> link_wrenches;  ///< one a link of touching_links
    std::vector<nav_msgs::Odometry> odometry;                 ///< of a base that moves, one
    std::vector<sensor_msgs::Imu> imu;                        ///< likewise
  };
  OfState Show(const Instant& now, const ros::Time& stamp) const;
  /// Links that constraints touch with, of a robot.
  std::vector<std::string> touching_links() const;

  bool has_terrain() const { return robot_ != nullptr; }
  visualization_msgs::MarkerArray Terrain() const { return robot_->Terrain(); }
  tf2_msgs::TFMessage Static(const ros::Time& stamp) const;

 private:
  const std::shared_ptr<const Setup> setup_;
  const DisplayOptions options_;
  std::unique_ptr<RobotDisplay> robot_;
  std::unique_ptr<PointDisplay> points_;
};

/// The status as `node` tells it on /diagnostics; `hardware`: the simulated model or robot;
/// `error`: of the recording.
diagnostic_msgs::DiagnosticArray ToDiagnostics(const SimulatorStatus& status,
                                               const std::string& node, const std::string& hardware,
                                               const std::string& error);

/// A name of a constraint as part of a topic: letters, digits and '_'.
std::string TopicName(std::string name);

}  // namespace ros_interface
}  // namespace contact_flow
