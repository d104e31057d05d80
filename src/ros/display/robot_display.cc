// SPDX-License-Identifier: BSD-3-Clause
#include "robot_display.h"

#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "contact_flow/model/rigid_body/contact_place.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "contact_flow/model/rigid_body/urdf_loader.h"
#include "src/ros/message/geometry.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using visualization_msgs::Marker;
using visualization_msgs::MarkerArray;

void SetPose(const Pose& pose, Marker* marker) {
  marker->pose.position = ToPoint(pose.position);
  marker->pose.orientation = ToQuaternion(pose.rotation);
}

void SetScale(double x, double y, double z, Marker* marker) {
  marker->scale.x = x;
  marker->scale.y = y;
  marker->scale.z = z;
}

Pose ToPose(const urdf::Pose& pose) {
  const double q[] = {pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z};
  return {QuaternionRotation(q), {pose.position.x, pose.position.y, pose.position.z}};
}

/// Type, size and mesh of a marker from a shape of a URDF.
Marker ToMarker(const urdf::Geometry& geometry) {
  Marker marker;
  switch (geometry.type) {
    case urdf::Geometry::SPHERE: {
      marker.type = Marker::SPHERE;
      const double d = 2 * static_cast<const urdf::Sphere&>(geometry).radius;
      SetScale(d, d, d, &marker);
      break;
    }
    case urdf::Geometry::BOX: {
      marker.type = Marker::CUBE;
      const urdf::Vector3& size = static_cast<const urdf::Box&>(geometry).dim;
      SetScale(size.x, size.y, size.z, &marker);
      break;
    }
    case urdf::Geometry::CYLINDER: {
      marker.type = Marker::CYLINDER;
      const auto& cylinder = static_cast<const urdf::Cylinder&>(geometry);
      SetScale(2 * cylinder.radius, 2 * cylinder.radius, cylinder.length, &marker);
      break;
    }
    case urdf::Geometry::MESH: {
      marker.type = Marker::MESH_RESOURCE;
      const auto& mesh = static_cast<const urdf::Mesh&>(geometry);
      marker.mesh_resource = mesh.filename;
      SetScale(mesh.scale.x, mesh.scale.y, mesh.scale.z, &marker);
      break;
    }
  }
  return marker;
}

/// The same of a shape of the collision geometry; a capsule as its cylinder.
Marker ToMarker(const RobotModel::Shape& shape) {
  using Kind = RobotModel::Shape::Kind;
  const bool ball = shape.kind == Kind::kSphere, mesh = shape.kind == Kind::kMesh;
  const bool round = !mesh && shape.kind != Kind::kBox;
  const double d = 2 * shape.size(0), length = ball ? d : shape.size(round ? 1 : 2);
  Marker marker;
  marker.type = mesh ? Marker::MESH_RESOURCE : Marker::CUBE;
  if (round) marker.type = ball ? Marker::SPHERE : Marker::CYLINDER;
  marker.mesh_resource = shape.mesh;
  SetScale(round ? d : shape.size(0), round ? d : shape.size(1), length, &marker);
  return marker;
}

int LinkIndex(const RobotModel& model, const std::string& name) {
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    if (model.links[i].name == name) return static_cast<int>(i);
  }
  throw std::invalid_argument("the URDF is not the robot's: there is no link '" + name + "'");
}

}  // namespace

std_msgs::ColorRGBA Color(double red, double green, double blue, double alpha) {
  std_msgs::ColorRGBA color;
  color.r = static_cast<float>(red);
  color.g = static_cast<float>(green);
  color.b = static_cast<float>(blue);
  color.a = static_cast<float>(alpha);
  return color;
}

sensor_msgs::JointState ToJointState(const MechanicalSystem& system, const VectorRef& x,
                                     const ros::Time& stamp) {
  const SystemDescription& names = system.description();
  const int nq = system.num_positions();
  sensor_msgs::JointState message;
  message.header.stamp = stamp;
  int v = 0;
  const std::vector<ConfigurationSpace::Rotation>& rotations = system.space().rotations();
  auto next = rotations.begin();
  for (int q = 0; q < nq;) {
    if (next != rotations.end() && q == next->q) {
      q += 4;
      v += 3;
      ++next;
      continue;
    }
    message.name.push_back(names.coordinates[static_cast<std::size_t>(q)]);
    message.position.push_back(x(q++));
    message.velocity.push_back(x(nq + v++));
  }
  return message;
}

RobotDisplay::RobotDisplay(const RobotSystem& system, const std::string& urdf,
                           DisplayOptions options)
    : system_(system), options_(std::move(options)) {
  const RobotModel& model = system_.robot().model;
  urdf::ModelInterfaceSharedPtr description = urdf::parseURDF(urdf);
  // A robot may run although urdfdom does not like its looks: it is then shown by its collisions.
  if (!description) description = urdf::parseURDF(UrdfStructure(urdf));
  if (!description) throw std::invalid_argument("the URDF cannot be parsed");
  root_ = description->getRoot()->name;
  base_alias_ = !options_.base_frame.empty() && description->links_.count(options_.base_frame) == 0;
  placements_.push_back({options_.world_frame, base_alias_ ? options_.base_frame : root_, -1,
                         LinkIndex(model, root_)});
  for (const auto& entry : description->joints_) {
    const urdf::Joint& joint = *entry.second;
    if (joint.type != urdf::Joint::FLOATING && joint.type != urdf::Joint::PLANAR) {
      joints_.insert(joint.name);  // of fixed ones there is no coordinate
      continue;
    }
    placements_.push_back({joint.parent_link_name, joint.child_link_name,
                           LinkIndex(model, joint.parent_link_name),
                           LinkIndex(model, joint.child_link_name)});
  }
  double mass = 0;
  for (const RobotModel::Link& link : model.links) {
    const auto described = description->links_.find(link.name);
    if (described == description->links_.end()) continue;  // a sole, or a pad
    mass += link.inertia.mass;
    for (const auto& visual : described->second->visual_array) {
      if (!visual->geometry) continue;
      shapes_.push_back(
          {link.pose * ToPose(visual->origin), link.body, ToMarker(*visual->geometry)});
    }
  }
  if (shapes_.empty()) {
    for (const RobotModel::Shape& shape : model.shapes) {
      const RobotModel::Link& link = model.links[shape.link];
      shapes_.push_back({link.pose * shape.pose, link.body, ToMarker(shape)});
    }
  }
  FindTouchingLinks();
  const double weight = mass * std::max(std::abs(system_.robot().gravity), 1e-3);
  metres_per_newton_ = options_.force_length / std::max(weight, 1e-9);
}

sensor_msgs::JointState RobotDisplay::Joints(const VectorRef& x, const ros::Time& stamp) const {
  sensor_msgs::JointState message = ToJointState(system_, x, stamp);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    if (joints_.count(message.name[i]) == 0) continue;
    message.name[kept] = message.name[i];
    message.position[kept] = message.position[i];
    message.velocity[kept++] = message.velocity[i];
  }
  message.name.resize(kept);
  message.position.resize(kept);
  message.velocity.resize(kept);
  for (const std::string& held : system_.robot().model.held) {
    message.name.push_back(held);
    message.position.push_back(0);
    message.velocity.push_back(0);
  }
  return message;
}

Pose RobotDisplay::LinkPose(const TreeState<double>& state, int link) const {
  if (link < 0) return Pose();
  const RobotModel::Link& part = system_.robot().model.links[static_cast<std::size_t>(link)];
  if (part.body < 0) return part.pose;
  const TreeState<double>::Body& body = state.body[static_cast<std::size_t>(part.body)];
  return Pose{body.rotation, body.position} * part.pose;
}

std::vector<geometry_msgs::TransformStamped> RobotDisplay::Transforms(
    const VectorRef& x, const ros::Time& stamp) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  std::vector<geometry_msgs::TransformStamped> transforms;
  for (const Placement& placement : placements_) {
    const Pose pose =
        LinkPose(state, placement.parent_link).Inverse() * LinkPose(state, placement.child_link);
    const bool base = placement.parent_link < 0;
    transforms.push_back(ToTransform(pose.rotation, pose.position,
                                     (base ? "" : options_.prefix) + placement.parent,
                                     options_.prefix + placement.child, stamp));
  }
  AddTerrainTransforms(x, stamp, &transforms);
  return transforms;
}

std::vector<geometry_msgs::TransformStamped> RobotDisplay::StaticTransforms(
    const ros::Time& stamp) const {
  if (!base_alias_) return {};
  return {ToTransform(Mat3<double>::Identity(), Vec3<double>::Zero(),
                      options_.prefix + options_.base_frame, options_.prefix + root_, stamp)};
}

Marker RobotDisplay::Begin(const std::string& name, int id, const ros::Time& stamp) const {
  Marker marker;
  marker.header.frame_id = options_.world_frame;
  marker.header.stamp = stamp;
  marker.ns = name;
  marker.id = id;
  marker.action = Marker::ADD;
  marker.pose.orientation.w = 1;
  return marker;
}

MarkerArray RobotDisplay::Contacts(const VectorRef& x, ConstraintSet touching,
                                   const VectorRef& force, const ros::Time& stamp) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  MarkerArray array;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (system_.compliant().Contains(i)) continue;  // an instant of time
    Vec3<double> point, whole;
    PlaceContact(system_, i, state, force, &point, &whole);
    const bool active = touching.Contains(i);
    Marker sphere = Begin("contacts", i, stamp);
    sphere.type = Marker::SPHERE;
    sphere.pose.position = ToPoint(point);
    const double size = (active ? 1.3 : 1) * options_.point_size;
    SetScale(size, size, size, &sphere);
    sphere.color = active ? Color(1, 0.45, 0, 1) : Color(0.2, 0.5, 1, 1);
    array.markers.push_back(sphere);
    Marker arrow = Begin("forces", i, stamp);
    arrow.type = Marker::ARROW;
    const Vec3<double> length = metres_per_newton_ * whole;
    if (active && length.norm() > 1e-6) {
      arrow.points = {ToPoint(point), ToPoint(point + length)};
      SetScale(0.4 * options_.point_size, 0.9 * options_.point_size, 0, &arrow);
      arrow.color = Color(0.9, 0.1, 0.1, 1);
    } else {
      arrow.action = Marker::DELETE;
    }
    array.markers.push_back(arrow);
  }
  return array;
}

MarkerArray RobotDisplay::Ghost(const VectorRef& x, const std::string& name,
                                const std_msgs::ColorRGBA& color) const {
  const RigidBodyTree& tree = system_.robot().model.tree;
  TreeState<double> state(tree);
  UpdatePositions(tree, x.data(), &state);
  MarkerArray array;
  for (const Shape& shape : shapes_) {
    Marker marker = Begin(name, static_cast<int>(array.markers.size()), ros::Time());
    marker.type = shape.marker.type;
    marker.scale = shape.marker.scale;
    marker.mesh_resource = shape.marker.mesh_resource;
    Pose pose = shape.pose;
    if (shape.body >= 0) {
      const TreeState<double>::Body& body = state.body[static_cast<std::size_t>(shape.body)];
      pose = Pose{body.rotation, body.position} * shape.pose;
    }
    SetPose(pose, &marker);
    marker.color = color;
    array.markers.push_back(marker);
  }
  return array;
}

MarkerArray RobotDisplay::Nothing() {
  MarkerArray array;
  array.markers.emplace_back();
  array.markers.back().action = Marker::DELETEALL;
  return array;
}

}  // namespace ros_interface
}  // namespace contact_flow
