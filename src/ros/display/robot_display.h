// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <geometry_msgs/Wrench.h>
#include <geometry_msgs/WrenchStamped.h>
#include <nav_msgs/Odometry.h>
#include <ros/time.h>
#include <sensor_msgs/Imu.h>
#include <sensor_msgs/JointState.h>
#include <std_msgs/ColorRGBA.h>
#include <visualization_msgs/MarkerArray.h>

#include <set>
#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/robot_system.h"
#include "src/ros/message/conversions.h"

namespace contact_flow {
namespace ros_interface {

/// Every coordinate of a system that is one number, with its rate; quaternions are left out.
/// Efforts are empty.
sensor_msgs::JointState ToJointState(const MechanicalSystem& system, const VectorRef& x,
                                     const ros::Time& stamp);

/// Frames of REP 105 and sizes of what is drawn.
struct DisplayOptions {
  std::string world_frame = kWorldFrame;  ///< fixed in the world, z up
  std::string base_frame = "base_link";   ///< another name of the root link; "": none
  std::string prefix;  ///< put before the names of all links, as robot_state_publisher's tf_prefix
  double force_length = 0.3;  ///< of an arrow that stands for the robot's whole weight [m]
  double point_size = 0.03;   ///< diameter of a contact point [m]
  double terrain_size = 2;    ///< half the width of the terrain around the nominal state [m]
};

std_msgs::ColorRGBA Color(double red, double green, double blue, double alpha);

/// A robot at a state as ROS tools show it: transforms that robot_state_publisher cannot know, and
/// markers for rviz, all in the world frame. Values only: who has the state publishes them.
/// Constant after construction; the system must outlive it.
class RobotDisplay {
 public:
  /// `urdf` is the text that the robot was made of: its shapes are drawn.
  RobotDisplay(const RobotSystem& system, const std::string& urdf, DisplayOptions options = {});

  /// The joints of the URDF that have one number, which is what robot_state_publisher understands.
  sensor_msgs::JointState Joints(const VectorRef& x, const ros::Time& stamp) const;
  /// The same with what springs, controllers and actuators put on them under the inputs u.
  sensor_msgs::JointState Joints(const VectorRef& x, const VectorRef& u, ContactMode mode,
                                 const ros::Time& stamp) const;
  /// Whether the root link can move.
  bool base_moves() const;
  /// Pose of the root link in the world, and its velocities in its own axes.
  nav_msgs::Odometry Odometry(const VectorRef& x, const ros::Time& stamp) const;
  /// What an inertial measurement unit at the origin of the root link measures, in its axes:
  /// orientation, angular velocity, and v̇ less gravity, at accelerations v̇ [d].
  sensor_msgs::Imu Imu(const VectorRef& x, const VectorRef& acceleration,
                       const ros::Time& stamp) const;
  /// Links that constraints name, those that are touched among them.
  const std::vector<std::string>& touching_links() const { return touching_; }
  /// On each of them the wrench of all its contacts, friction with it, about its origin and in its
  /// axes, for λ [n+l+r].
  std::vector<geometry_msgs::WrenchStamped> LinkWrenches(const VectorRef& x, const VectorRef& force,
                                                         const ros::Time& stamp) const;
  /// The base in the world, the links that hang on floating and planar joints, and the ground that
  /// moves (terrain_1, …).
  std::vector<geometry_msgs::TransformStamped> Transforms(const VectorRef& x,
                                                          const ros::Time& stamp) const;
  /// The root link in base_frame, where that is another name.
  std::vector<geometry_msgs::TransformStamped> StaticTransforms(const ros::Time& stamp) const;

  /// A sphere at the point of each constraint, orange where it is in the contact mode, blue where
  /// it is not (namespace "contacts"), and an arrow along each contact's whole force, that of
  /// friction with it (namespace "forces"), for λ [n+l+r].
  visualization_msgs::MarkerArray Contacts(const VectorRef& x, ConstraintSet touching,
                                           const VectorRef& force, const ros::Time& stamp) const;
  /// The wrench of each contact's force, that of friction with it, on the robot, for λ [n+l+r];
  /// about the world's origin in world axes; zero for limits. [n]
  std::vector<geometry_msgs::Wrench> ContactWrenches(const VectorRef& x,
                                                     const VectorRef& force) const;
  /// The planes, height fields, height maps and stairs of the world, each once (namespace
  /// "terrain"); those that move in frames of their own, as Transforms places them.
  visualization_msgs::MarkerArray Terrain() const;
  /// The shapes of all links at another state, in one colour.
  visualization_msgs::MarkerArray Ghost(const VectorRef& x, const std::string& name,
                                        const std_msgs::ColorRGBA& color) const;
  /// What removes all markers of a topic.
  static visualization_msgs::MarkerArray Nothing();

 private:
  /// A shape of a link; its marker has no frame, pose and colour yet.
  struct Shape {
    Pose pose;  // in the body's frame, the world's for −1
    int body;
    visualization_msgs::Marker marker;
  };
  /// A link that a transform of ours places against another, or the root against the world.
  struct Placement {
    std::string parent, child;
    int parent_link, child_link;  // −1: the world
  };

  visualization_msgs::Marker Begin(const std::string& name, int id, const ros::Time& stamp) const;
  Pose LinkPose(const TreeState<double>& state, int link) const;
  std::string TerrainFrame(int piece) const;
  void AddTerrainTransforms(const VectorRef& x, const ros::Time& stamp,
                            std::vector<geometry_msgs::TransformStamped>* transforms) const;

  const RobotSystem& system_;
  const DisplayOptions options_;
  std::string root_;
  bool base_alias_ = false;  // base_frame is another name of the root
  void FindTouchingLinks();

  std::set<std::string> joints_;  // with one number
  std::vector<std::string> touching_;
  std::vector<int> touching_link_;  // of each, in the model
  // Of each constraint, in touching_: the link that it is on, and the one that it is against; −1:
  // none, or the world.
  std::vector<int> place_, other_place_;
  std::vector<Shape> shapes_;
  std::vector<Placement> placements_;
  double metres_per_newton_ = 0;
};

}  // namespace ros_interface
}  // namespace contact_flow
