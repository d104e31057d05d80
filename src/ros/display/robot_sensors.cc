// SPDX-License-Identifier: BSD-3-Clause
// What sensors of a robot would tell of a state.
#include <algorithm>

#include "contact_flow/model/rigid_body/contact_place.h"
#include "contact_flow/model/rigid_body/inverse_dynamics.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "robot_display.h"
#include "src/ros/message/geometry.h"

namespace contact_flow {
namespace ros_interface {

sensor_msgs::JointState RobotDisplay::Joints(const VectorRef& x, const VectorRef& u,
                                             ContactMode mode, const ros::Time& stamp) const {
  sensor_msgs::JointState message = Joints(x, stamp);
  const int nq = system_.num_positions();
  const Vector efforts = system_.JointEfforts(x.head(nq), x.tail(system_.dof()), u, mode);
  const std::vector<std::string>& held = system_.robot().model.held;
  for (const std::string& joint : message.name) {
    const bool moves = std::find(held.begin(), held.end(), joint) == held.end();
    message.effort.push_back(moves ? efforts(system_.robot().model.FindCoordinate(joint).v) : 0);
  }
  return message;
}

bool RobotDisplay::base_moves() const {
  const auto root = static_cast<std::size_t>(placements_.front().child_link);
  return system_.robot().model.links[root].body >= 0;
}

nav_msgs::Odometry RobotDisplay::Odometry(const VectorRef& x, const ros::Time& stamp) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  UpdateVelocities(tree, x.data() + system_.num_positions(), &state);
  const Placement& base = placements_.front();
  const Pose pose = LinkPose(state, base.child_link);
  const int body = system_.robot().model.links[static_cast<std::size_t>(base.child_link)].body;
  const Mat3<double> back = pose.rotation.transpose();
  nav_msgs::Odometry message;
  message.header.stamp = stamp;
  message.header.frame_id = base.parent;
  message.child_frame_id = options_.prefix + base.child;
  message.pose.pose.position = ToPoint(pose.position);
  message.pose.pose.orientation = ToQuaternion(pose.rotation);
  message.twist.twist.linear = ToVector(back * PointVelocity(state, body, pose.position));
  message.twist.twist.angular =
      ToVector(back * state.body[static_cast<std::size_t>(body)].velocity.ang);
  return message;
}

sensor_msgs::Imu RobotDisplay::Imu(const VectorRef& x, const VectorRef& acceleration,
                                   const ros::Time& stamp) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  UpdateVelocities(tree, x.data() + system_.num_positions(), &state);
  UpdateAccelerations(tree, tree.gravity(), acceleration.data(), &state);
  const Placement& base = placements_.front();
  const Pose pose = LinkPose(state, base.child_link);
  const int body = system_.robot().model.links[static_cast<std::size_t>(base.child_link)].body;
  const TreeState<double>::Body& motion = state.body[static_cast<std::size_t>(body)];
  const Mat3<double> back = pose.rotation.transpose();
  sensor_msgs::Imu message;
  message.header.stamp = stamp;
  message.header.frame_id = options_.prefix + base.child;
  message.orientation = ToQuaternion(pose.rotation);
  message.angular_velocity = ToVector(back * motion.velocity.ang);
  // A body's acceleration is that less gravity.
  message.linear_acceleration =
      ToVector(back * PointAcceleration(state, body, motion.acceleration, pose.position));
  return message;
}

void RobotDisplay::FindTouchingLinks() {
  const RobotModel& model = system_.robot().model;
  const auto place = [&](const ElementParts& parts, std::size_t k) {
    if (k >= parts.points.size() || parts.points[k].body < 0 || parts.points[k].link < 0) return -1;
    const int link = parts.points[k].link;
    const auto known = std::find(touching_link_.begin(), touching_link_.end(), link);
    const int found = static_cast<int>(known - touching_link_.begin());
    if (known == touching_link_.end()) {
      touching_link_.push_back(link);
      touching_.push_back(model.links[static_cast<std::size_t>(link)].name);
    }
    return found;
  };
  for (const auto& constraint : system_.robot().constraints) {
    const bool touches = constraint->Touches();
    place_.push_back(touches ? place(constraint->parts, 0) : -1);
    other_place_.push_back(touches ? place(constraint->parts, 1) : -1);
  }
}

std::vector<geometry_msgs::WrenchStamped> RobotDisplay::LinkWrenches(const VectorRef& x,
                                                                     const VectorRef& force,
                                                                     const ros::Time& stamp) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  std::vector<Vec3<double>> push(touching_.size(), Vec3<double>::Zero()), turn = push;
  const auto add = [&](int k, const Vec3<double>& point, const Vec3<double>& f) {
    if (k < 0) return;
    const auto at = static_cast<std::size_t>(k);
    const Vec3<double> arm = point - LinkPose(state, touching_link_[at]).position;
    push[at] += f;
    turn[at] += arm.cross(f);
  };
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (place_[at] < 0 && other_place_[at] < 0) continue;
    Vec3<double> point, f;
    PlaceContact(system_, i, state, force, &point, &f);
    add(place_[at], point, f);
    add(other_place_[at], point, -f);
  }
  std::vector<geometry_msgs::WrenchStamped> messages(touching_.size());
  for (std::size_t k = 0; k < messages.size(); ++k) {
    const Mat3<double> back = LinkPose(state, touching_link_[k]).rotation.transpose();
    messages[k].header.stamp = stamp;
    messages[k].header.frame_id = options_.prefix + touching_[k];
    messages[k].wrench.force = ToVector(back * push[k]);
    messages[k].wrench.torque = ToVector(back * turn[k]);
  }
  return messages;
}

}  // namespace ros_interface
}  // namespace contact_flow
