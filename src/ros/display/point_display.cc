// SPDX-License-Identifier: BSD-3-Clause
#include "point_display.h"

#include <algorithm>
#include <utility>

#include "src/ros/message/geometry.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using visualization_msgs::Marker;

constexpr double kMetresPerNewton = 0.02;

/// "body_pitch" is ("body", "pitch"), "x" is ("", "x").
std::pair<std::string, std::string> Split(const std::string& name) {
  const std::size_t bar = name.find_last_of('_');
  if (bar == std::string::npos) return {"", name};
  return {name.substr(0, bar), name.substr(bar + 1)};
}

}  // namespace

PointDisplay::PointDisplay(const MechanicalSystem& system, DisplayOptions options)
    : system_(system), options_(std::move(options)) {
  const SystemDescription& names = system.description();
  const auto velocity = [&](const std::string& name) {
    const auto it = std::find(names.velocities.begin(), names.velocities.end(), name);
    return it == names.velocities.end() ? -1 : static_cast<int>(it - names.velocities.begin());
  };
  for (int k = 0; k < system.num_positions(); ++k) {
    const std::string& name = names.coordinates[static_cast<std::size_t>(k)];
    const auto [frame, axis] = Split(name);
    if (axis.size() == 1 && axis[0] >= 'x' && axis[0] <= 'z') {
      FrameNamed(frame)->q[axis[0] - 'x'] = k;
      FrameNamed(frame)->v[axis[0] - 'x'] = velocity(name);
    } else if (axis == "pitch") {
      FrameNamed(frame)->pitch_q = k;
      FrameNamed(frame)->pitch_v = velocity(name);
    }
  }
  for (const ConfigurationSpace::Rotation& rotation : system.space().rotations()) {
    const std::string& name = names.coordinates[static_cast<std::size_t>(rotation.q)];
    FrameNamed(Split(name).first)->quaternion = rotation.q;
  }
}

PointDisplay::Frame* PointDisplay::FrameNamed(const std::string& asked) {
  const std::string name = asked.empty() ? system_.description().name : asked;
  for (Frame& frame : frames_) {
    if (frame.name == name) return &frame;
  }
  frames_.emplace_back();
  frames_.back().name = name;
  return &frames_.back();
}

Eigen::Vector3d PointDisplay::Position(const Frame& frame, const VectorRef& x) const {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    if (frame.q[axis] >= 0) p(axis) = x(frame.q[axis]);
  }
  return p;
}

Eigen::Quaterniond PointDisplay::Rotation(const Frame& frame, const VectorRef& x) const {
  if (frame.quaternion >= 0) {
    const auto w = x.segment<4>(frame.quaternion);
    return Eigen::Quaterniond(w(0), w(1), w(2), w(3)).normalized();
  }
  if (frame.pitch_q < 0) return Eigen::Quaterniond::Identity();
  const bool upright = frame.q[2] >= 0 || frame.q[1] < 0;  // in the plane x–z
  const Eigen::Vector3d axis = upright ? Eigen::Vector3d(0, -1, 0) : Eigen::Vector3d(0, 0, 1);
  return Eigen::Quaterniond(Eigen::AngleAxisd(x(frame.pitch_q), axis));
}

void PointDisplay::UnitForce(const Frame& frame, const ConstraintTerms& terms, int i,
                             Eigen::Vector3d* force, Eigen::Vector3d* torque) const {
  force->setZero();
  torque->setZero();
  for (int axis = 0; axis < 3; ++axis) {
    if (frame.v[axis] >= 0) (*force)(axis) = terms.jacobian(i, frame.v[axis]);
  }
  if (frame.pitch_v < 0) return;
  const bool upright = frame.q[2] >= 0 || frame.q[1] < 0;
  (*torque)(upright ? 1 : 2) = (upright ? -1 : 1) * terms.jacobian(i, frame.pitch_v);
}

void PointDisplay::Force(const Frame& frame, const ConstraintTerms& terms, int i,
                         const VectorRef& lambda, Eigen::Vector3d* force,
                         Eigen::Vector3d* torque) const {
  UnitForce(frame, terms, i, force, torque);
  *force *= lambda(i);
  *torque *= lambda(i);
  if (!system_.HasFriction()) return;
  const Friction& friction = system_.friction()[static_cast<std::size_t>(i)];
  for (int r = 0; r < friction.dimension; ++r) {
    Eigen::Vector3d unit, turn;
    UnitForce(frame, terms, friction.row + r, &unit, &turn);
    *force += lambda(friction.row + r) * unit;
    *torque += lambda(friction.row + r) * turn;
  }
}

std::vector<geometry_msgs::TransformStamped> PointDisplay::Transforms(
    const VectorRef& x, const ros::Time& stamp) const {
  std::vector<geometry_msgs::TransformStamped> transforms;
  for (const Frame& frame : frames_) {
    geometry_msgs::TransformStamped message;
    message.header.stamp = stamp;
    message.header.frame_id = options_.world_frame;
    message.child_frame_id =
        options_.prefix.empty() ? frame.name : options_.prefix + "/" + frame.name;
    message.transform.translation = ToVector(Position(frame, x));
    message.transform.rotation = ToQuaternion(Rotation(frame, x));
    transforms.push_back(message);
  }
  return transforms;
}

visualization_msgs::MarkerArray PointDisplay::Contacts(const VectorRef& x, ConstraintSet touching,
                                                       const VectorRef& force,
                                                       const ros::Time& stamp) const {
  ConstraintTerms terms;
  system_.Constraints(x.head(system_.num_positions()), x.tail(system_.dof()), &terms);
  visualization_msgs::MarkerArray array;
  const auto begin = [&](const char* name, int id) {
    Marker marker;
    marker.header.stamp = stamp;
    marker.header.frame_id = options_.world_frame;
    marker.ns = name;
    marker.id = id;
    marker.pose.orientation.w = 1;
    return marker;
  };
  const int n = system_.num_constraints();
  for (int k = 0; k < static_cast<int>(frames_.size()); ++k) {
    const Frame& frame = frames_[static_cast<std::size_t>(k)];
    const Eigen::Vector3d p = Position(frame, x);
    bool touched = false;
    for (int i = 0; i < n; ++i) {
      Eigen::Vector3d unit, torque, whole;
      UnitForce(frame, terms, i, &unit, &torque);
      Force(frame, terms, i, force, &whole, &torque);
      const bool acts = touching.Contains(i) && unit.norm() > 0;
      touched = touched || acts;
      Marker arrow = begin("forces", k * n + i);
      const Eigen::Vector3d length = kMetresPerNewton * whole;
      if (acts && length.norm() > 1e-6) {
        arrow.type = Marker::ARROW;
        arrow.points = {ToPoint(p), ToPoint(p + length)};
        arrow.scale.x = 0.4 * options_.point_size;
        arrow.scale.y = 0.9 * options_.point_size;
        arrow.color = Color(0.9, 0.1, 0.1, 1);
      } else {
        arrow.action = Marker::DELETE;
      }
      array.markers.push_back(arrow);
    }
    Marker sphere = begin("bodies", k);
    sphere.type = Marker::SPHERE;
    sphere.pose.position = ToPoint(p);
    sphere.scale.x = sphere.scale.y = sphere.scale.z = 2 * options_.point_size;
    sphere.color = touched ? Color(1, 0.45, 0, 1) : Color(0.2, 0.5, 1, 1);
    array.markers.push_back(sphere);
  }
  return array;
}

std::vector<geometry_msgs::Wrench> PointDisplay::ContactWrenches(const VectorRef& x,
                                                                 const VectorRef& force) const {
  ConstraintTerms terms;
  system_.Constraints(x.head(system_.num_positions()), x.tail(system_.dof()), &terms);
  std::vector<geometry_msgs::Wrench> wrenches(static_cast<std::size_t>(system_.num_constraints()));
  for (int i = 0; i < system_.num_constraints(); ++i) {
    Eigen::Vector3d f = Eigen::Vector3d::Zero(), torque = Eigen::Vector3d::Zero();
    for (const Frame& frame : frames_) {
      Eigen::Vector3d whole, turn;
      Force(frame, terms, i, force, &whole, &turn);
      f += whole;
      torque += turn + Position(frame, x).cross(whole);
    }
    wrenches[static_cast<std::size_t>(i)] = ToMsg(f, torque);
  }
  return wrenches;
}

}  // namespace ros_interface
}  // namespace contact_flow
