// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Wrench.h>
#include <ros/time.h>
#include <visualization_msgs/MarkerArray.h>

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "robot_display.h"

namespace contact_flow {
namespace ros_interface {

/// What ROS tools can be shown of a system without a URDF, by the names of its coordinates: body_x,
/// body_z and body_pitch are a frame `body`; x, y, z alone that of the system. Positions are along
/// the world's axes; a pitch turns the axis x towards z, in planar systems without z towards y; a
/// quaternion turns all.
class PointDisplay {
 public:
  PointDisplay(const MechanicalSystem& system, DisplayOptions options);

  std::vector<geometry_msgs::TransformStamped> Transforms(const VectorRef& x,
                                                          const ros::Time& stamp) const;
  /// A sphere at every frame (namespace "bodies"), and an arrow for every contact's force on it,
  /// that of friction with it ("forces"), for λ [n+l+r].
  visualization_msgs::MarkerArray Contacts(const VectorRef& x, ConstraintSet touching,
                                           const VectorRef& force, const ros::Time& stamp) const;
  /// The wrench of each contact's force for λ [n+l+r], about the world's origin: the parts of
  /// Da_iᵀ λ_n,i + T_iᵀ λ_t,i along the frames' coordinates. [n]
  std::vector<geometry_msgs::Wrench> ContactWrenches(const VectorRef& x,
                                                     const VectorRef& force) const;

 private:
  /// Indices into q, and into v; −1: none.
  struct Frame {
    std::string name;
    int q[3] = {-1, -1, -1};
    int v[3] = {-1, -1, -1};
    int pitch_q = -1, pitch_v = -1;
    int quaternion = -1;
  };

  Frame* FrameNamed(const std::string& name);
  Eigen::Vector3d Position(const Frame& frame, const VectorRef& x) const;
  Eigen::Quaterniond Rotation(const Frame& frame, const VectorRef& x) const;
  /// Force of row i on the frame at λ_i = 1, and the torque of its pitch about the axis
  /// that it turns about.
  void UnitForce(const Frame& frame, const ConstraintTerms& terms, int i, Eigen::Vector3d* force,
                 Eigen::Vector3d* torque) const;
  /// The same of contact i and its friction, at λ [n+l+r].
  void Force(const Frame& frame, const ConstraintTerms& terms, int i, const VectorRef& lambda,
             Eigen::Vector3d* force, Eigen::Vector3d* torque) const;

  const MechanicalSystem& system_;
  const DisplayOptions options_;
  std::vector<Frame> frames_;
};

}  // namespace ros_interface
}  // namespace contact_flow
