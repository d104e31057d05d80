// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/urdf_loader.h"

#include <urdf_model/model.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "idle_joints.h"
#include "inertia_judge.h"
#include "urdf_lines.h"
#include "urdf_parse.h"
#include "urdf_source.h"
#include "urdf_traits.h"

namespace contact_flow {
namespace {

/// Links of a loop hold one another, and would never be freed.
struct LoopBreaker {
  const urdf::ModelInterfaceSharedPtr& model;
  ~LoopBreaker() {
    for (const auto& entry : model->links_) entry.second->child_links.clear();
  }
};

Vec3<double> ReadVector(const urdf::Vector3& v, const std::string& owner) {
  const Vec3<double> vector(v.x, v.y, v.z);
  if (!vector.allFinite()) FailUrdf(owner + ": a number is not finite");
  return vector;
}

Pose ReadPose(const urdf::Pose& pose, const std::string& owner) {
  const double q[] = {pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z};
  const Mat3<double> rotation = QuaternionRotation(q);
  if (!rotation.allFinite()) FailUrdf(owner + ": its rotation is not finite");
  return {rotation, ReadVector(pose.position, owner)};
}

BodyInertia ReadInertia(const urdf::Link& link, UrdfFaults faults, Findings* findings) {
  if (!link.inertial) return BodyInertia();
  const urdf::Inertial& given = *link.inertial;
  const std::string owner = "link '" + link.name + "'";
  BodyInertia inertia;
  inertia.mass = given.mass;
  if (!(inertia.mass >= 0) || !std::isfinite(inertia.mass) ||
      (inertia.mass == 0 && faults == UrdfFaults::kStrict)) {
    findings->errors.push_back(owner + ": its mass is " + std::to_string(given.mass) +
                               ", expected more than 0 (leave out <inertial> for a link without "
                               "mass)");
    return BodyInertia();
  }
  inertia.central << given.ixx, given.ixy, given.ixz, given.ixy, given.iyy, given.iyz, given.ixz,
      given.iyz, given.izz;
  if (!inertia.central.allFinite()) {
    findings->errors.push_back(owner + ": its inertia is not finite");
    return BodyInertia();
  }
  if (inertia.mass == 0) {
    if (!inertia.central.isZero(0)) {
      findings->warnings.push_back(owner +
                                   ": its mass is 0, so that its inertia is not used (a "
                                   "rotor is `joints: {armature: …}` of a robot's YAML)");
    }
    return BodyInertia();
  }
  return inertia.In(ReadPose(given.origin, owner));
}

Vec3<double> ReadAxis(const urdf::Joint& joint, RobotModel* robot) {
  const std::string owner = "joint '" + joint.name + "'";
  const Vec3<double> axis = ReadVector(joint.axis, owner);
  const double length = axis.norm();
  if (!(length > 1e-6) || !std::isfinite(length)) FailUrdf(owner + ": its axis has no direction");
  if (std::abs(length - 1) > 1e-3) {
    robot->warnings.push_back(owner + ": its axis has length " + std::to_string(length) +
                              "; only its direction is used");
  }
  return axis / length;
}

RobotModel::Mount AddJoint(const urdf::Joint& joint, const RobotModel::Mount& frame,
                           RobotModel* robot) {
  if (std::find(robot->held.begin(), robot->held.end(), joint.name) != robot->held.end()) {
    return frame;
  }
  switch (joint.type) {
    case urdf::Joint::FIXED:
      return frame;
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS:
      return robot->AddRevolute(frame, joint.name, ReadAxis(joint, robot),
                                joint.type == urdf::Joint::CONTINUOUS);
    case urdf::Joint::PRISMATIC:
      return robot->AddPrismatic(frame, joint.name, ReadAxis(joint, robot));
    case urdf::Joint::PLANAR: {
      const Mat3<double> plane = AxisFrame(ReadAxis(joint, robot));
      return robot->AddPlanar(frame, joint.name, plane.col(0), plane.col(1), plane.col(2),
                              {"_x", "_y", "_angle"});
    }
    case urdf::Joint::FLOATING:
      return robot->AddFloating(frame, joint.name);
    default:
      FailUrdf("joint '" + joint.name + "' has no known type");
  }
}

RobotModel::Mount AddBase(RobotBase base, RobotModel* robot) {
  const RobotModel::Mount world{-1, Pose()};
  using Axis = Vec3<double>;
  switch (base) {
    case RobotBase::kPlanar:
      return robot->AddPlanar(world, "base", Axis::UnitX(), Axis::UnitZ(), Axis::UnitY(),
                              {"_x", "_z", "_pitch"});
    case RobotBase::kFloating:
      return robot->AddFloating(world, "base");
    default:
      return world;
  }
}

/// Every link has at most one parent joint, which urdfdom does not ask for.
void CheckJoints(const urdf::ModelInterface& model, Findings* findings) {
  std::set<std::string> children;
  for (const auto& entry : model.joints_) {
    const urdf::Joint& joint = *entry.second;
    if (!children.insert(joint.child_link_name).second) {
      findings->errors.push_back("link '" + joint.child_link_name +
                                 "' is the child of two joints, one is '" + joint.name +
                                 "': take that out and close the loop by closures instead");
    }
  }
}

void CheckNames(const RobotModel& robot, Findings* findings) {
  std::set<std::string> names;
  for (const std::string& name : robot.coordinates) {
    if (!names.insert(name).second) {
      findings->errors.push_back("two coordinates are called '" + name + "': rename a joint");
    }
  }
}

/// Adds the link and the joint it hangs on; returns where the link is.
RobotModel::Mount AddLink(const urdf::Link& link, const RobotModel::Mount& parent,
                          UrdfFaults faults, RobotModel* robot, Findings* findings) {
  RobotModel::Mount mount = parent;
  if (link.parent_joint) {
    const urdf::Joint& joint = *link.parent_joint;
    const Pose origin =
        ReadPose(joint.parent_to_joint_origin_transform, "joint '" + joint.name + "'");
    mount = AddJoint(joint, {parent.body, parent.pose * origin}, robot);
  }
  robot->links.push_back({link.name, mount.body, mount.pose, ReadInertia(link, faults, findings)});
  return mount;
}

/// Bodies and links, from the root.
void AddTree(const urdf::ModelInterface& model, RobotBase base, UrdfFaults faults,
             RobotModel* robot, Findings* findings) {
  struct Visit {
    urdf::LinkConstSharedPtr link;
    RobotModel::Mount parent;
  };
  std::vector<Visit> open = {{model.getRoot(), AddBase(base, robot)}};
  std::set<std::string> found;
  while (!open.empty()) {
    const Visit next = open.back();
    open.pop_back();
    const urdf::Link& link = *next.link;
    if (!found.insert(link.name).second) {
      findings->errors.push_back("link '" + link.name + "' is in a loop");
      return;
    }
    const RobotModel::Mount mount = AddLink(link, next.parent, faults, robot, findings);
    for (std::size_t k = link.child_links.size(); k-- > 0;) {  // taken from the back
      open.push_back({link.child_links[k], mount});
    }
  }
  for (const auto& entry : model.links_) {
    if (found.count(entry.first) > 0) continue;
    findings->errors.push_back("link '" + entry.first + "' is not connected to the root '" +
                               model.getRoot()->name + "'");
  }
}

std::string Listed(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += " '" + name + "'";
  return list;
}

}  // namespace

const std::vector<std::string>& UrdfFaultsNames() {
  static const std::vector<std::string> names = {"lenient", "strict"};
  return names;
}

namespace {

RobotModel MakeModel(const UrdfSource& source, RobotBase base, UrdfFaults faults,
                     Findings findings) {
  const urdf::ModelInterfaceSharedPtr model = ParseByUrdfdom(source.text);
  const LoopBreaker breaker{model};
  CheckJoints(*model, &findings);
  RobotModel robot;
  std::vector<std::string> held;
  for (bool again = true; again;) {
    Findings of_tree = findings;
    robot = RobotModel();
    robot.name = model->getName();
    robot.held = held;
    AddTree(*model, base, faults, &robot, &of_tree);
    if (of_tree.errors.empty()) JudgeInertias(faults, &robot, &of_tree);
    CheckNames(robot, &of_tree);
    ReadMimics(*model, &robot, &of_tree);
    of_tree.ThrowIfAny();
    robot.warnings.insert(robot.warnings.end(), of_tree.warnings.begin(), of_tree.warnings.end());
    ReadTraits(*model, &robot);
    robot.JoinInertias();
    const std::vector<std::string> idle = IdleJoints(robot);
    again = !idle.empty() && faults == UrdfFaults::kLenient;
    if (again) held.insert(held.end(), idle.begin(), idle.end());
  }
  if (!held.empty()) {
    robot.warnings.push_back(
        "these joints move no mass and are held at zero; give what they carry "
        "an <inertial> to let them move:" +
        Listed(held));
  }
  WarnOfUnused(*model, &robot);
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    const auto shapes = source.shapes.find(robot.links[i].name);
    if (shapes == source.shapes.end()) continue;
    for (RobotModel::Shape shape : shapes->second) {
      shape.link = static_cast<int>(i);
      robot.shapes.push_back(std::move(shape));
    }
  }
  try {
    robot.CheckMass();
  } catch (const std::invalid_argument& error) {
    FailUrdf(error.what() +
             (held.empty() ? std::string()
                           : "; these joints move no mass, give what they carry an <inertial>:" +
                                 Listed(held)));
  }
  return robot;
}

constexpr std::size_t kMostMisspelt = 10;  // beside a refusal

/// What is missing is refused together with the names that may be it.
RobotModel ParseChecked(const std::string& text, RobotBase base, UrdfFaults faults) {
  Findings findings;
  const UrdfSource source = SortUrdf(text, faults, &findings);
  findings.ThrowIfAny();
  try {
    return MakeModel(source, base, faults, std::move(findings));
  } catch (const std::invalid_argument& error) {
    std::string all = error.what();
    const auto& names = source.unknown_names;
    for (std::size_t k = 0; k < names.size() && k < kMostMisspelt; ++k) all += "\n  " + names[k];
    throw std::invalid_argument(all);
  }
}

}  // namespace

RobotModel ParseUrdf(const std::string& given, RobotBase base, UrdfFaults faults) {
  // Some editors leave zeros at the end of a file, where urdfdom does not look.
  const std::string text = given.substr(0, given.find_last_not_of('\0') + 1);
  CheckUrdfText(text);
  try {
    return ParseChecked(text, base, faults);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(UrdfLines(text).Told(error.what()));
  }
}

}  // namespace contact_flow
