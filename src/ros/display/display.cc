// SPDX-License-Identifier: BSD-3-Clause
#include "display.h"

#include <diagnostic_updater/DiagnosticStatusWrapper.h>

#include <cctype>
#include <utility>

namespace contact_flow {
namespace ros_interface {

Display::Display(std::shared_ptr<const Setup> setup, const DisplayOptions& options)
    : setup_(std::move(setup)), options_(options) {
  if (setup_->robot != nullptr) {
    robot_ =
        std::make_unique<RobotDisplay>(*setup_->robot, setup_->configuration.robot.urdf, options_);
  } else {
    points_ = std::make_unique<PointDisplay>(*setup_->system, options_);
  }
}

tf2_msgs::TFMessage Display::Static(const ros::Time& stamp) const {
  tf2_msgs::TFMessage message;
  if (robot_) message.transforms = robot_->StaticTransforms(stamp);
  return message;
}

Display::OfState Display::Show(const Instant& now, const ros::Time& stamp) const {
  const Vector &x = now.x, &force = now.force;
  const ContactMode mode = now.mode;
  OfState shown;
  shown.joints =
      robot_ ? robot_->Joints(x, now.u, mode, stamp) : ToJointState(*setup_->system, x, stamp);
  shown.transforms.transforms =
      robot_ ? robot_->Transforms(x, stamp) : points_->Transforms(x, stamp);
  shown.contacts =
      robot_ ? robot_->Contacts(x, mode, force, stamp) : points_->Contacts(x, mode, force, stamp);
  const std::vector<geometry_msgs::Wrench> wrenches =
      robot_ ? robot_->ContactWrenches(x, force) : points_->ContactWrenches(x, force);
  for (const geometry_msgs::Wrench& wrench : wrenches) {
    geometry_msgs::WrenchStamped message;
    message.header.stamp = stamp;
    message.header.frame_id = options_.world_frame;
    message.wrench = wrench;
    shown.wrenches.push_back(message);
  }
  if (!robot_) return shown;
  shown.link_wrenches = robot_->LinkWrenches(x, force, stamp);
  if (!robot_->base_moves()) return shown;
  shown.odometry.push_back(robot_->Odometry(x, stamp));
  shown.imu.push_back(robot_->Imu(x, now.acceleration, stamp));
  return shown;
}

std::vector<std::string> Display::touching_links() const {
  return robot_ ? robot_->touching_links() : std::vector<std::string>();
}

diagnostic_msgs::DiagnosticArray ToDiagnostics(const SimulatorStatus& message,
                                               const std::string& node, const std::string& hardware,
                                               const std::string& error) {
  diagnostic_updater::DiagnosticStatusWrapper status;
  using Level = diagnostic_msgs::DiagnosticStatus;
  status.name = node + ": simulator";
  status.hardware_id = hardware;
  if (message.outcome != 0) {
    status.summary(Level::ERROR, message.message);
  } else if (!error.empty()) {
    status.summary(Level::ERROR, "recording: " + error);
  } else if (message.overruns > 0 && message.lateness > 0.01) {
    status.summary(Level::WARN, "the clock cannot be followed");
  } else {
    status.summary(Level::OK, message.paused ? "paused" : "running");
  }
  status.add("simulated time [s]", message.t);
  status.add("real-time factor asked", message.real_time_factor);
  status.add("real-time factor achieved", message.achieved_factor);
  status.add("events", message.events);
  status.add("events per second", message.events_per_second);
  status.add("lateness, last second [s]", message.lateness);
  status.add("lateness, largest [s]", message.largest_lateness);
  status.add("overruns", message.overruns);
  status.add("late inputs", message.late_inputs);
  status.add("margin: approach speed [m/s]", message.margins.approach_speed);
  status.add("margin: release rate [N/s]", message.margins.release_rate);
  status.add("margin: gap [m]", message.margins.gap);
  status.add("margin: force [N]", message.margins.force);
  status.add("margin: event interval [s]", message.margins.event_interval);
  diagnostic_msgs::DiagnosticArray array;
  array.status.push_back(status);
  array.header.stamp = message.header.stamp;
  return array;
}

/// A name of a constraint as part of a topic: letters, digits and '_'.
std::string TopicName(std::string name) {
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}

}  // namespace ros_interface
}  // namespace contact_flow
