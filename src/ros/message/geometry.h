// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Quaternion.h>
#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Vector3.h>
#include <ros/time.h>

#include <Eigen/Geometry>
#include <string>

namespace contact_flow {
namespace ros_interface {

inline geometry_msgs::Point ToPoint(const Eigen::Vector3d& p) {
  geometry_msgs::Point point;
  point.x = p(0);
  point.y = p(1);
  point.z = p(2);
  return point;
}

inline geometry_msgs::Vector3 ToVector(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 vector;
  vector.x = v(0);
  vector.y = v(1);
  vector.z = v(2);
  return vector;
}

/// Of unit length.
inline geometry_msgs::Quaternion ToQuaternion(const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond q = rotation.normalized();
  geometry_msgs::Quaternion message;
  message.x = q.x();
  message.y = q.y();
  message.z = q.z();
  message.w = q.w();
  return message;
}
inline geometry_msgs::Quaternion ToQuaternion(const Eigen::Matrix3d& rotation) {
  return ToQuaternion(Eigen::Quaterniond(rotation));
}

/// Of frame `child` in frame `parent`.
inline geometry_msgs::TransformStamped ToTransform(const Eigen::Matrix3d& rotation,
                                                   const Eigen::Vector3d& position,
                                                   const std::string& parent,
                                                   const std::string& child,
                                                   const ros::Time& stamp) {
  geometry_msgs::TransformStamped message;
  message.header.stamp = stamp;
  message.header.frame_id = parent;
  message.child_frame_id = child;
  message.transform.translation = ToVector(position);
  message.transform.rotation = ToQuaternion(rotation);
  return message;
}

}  // namespace ros_interface
}  // namespace contact_flow
