// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/urdf_loader.h"

#include <console_bridge/console.h>
#include <urdf_model/model.h>
#include <urdf_parser/urdf_parser.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <set>
#include <stdexcept>

#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw std::invalid_argument("URDF: " + what); }

/// Keeps what urdfdom would print.
class LogKeeper : public console_bridge::OutputHandler {
 public:
  LogKeeper() { console_bridge::useOutputHandler(this); }
  ~LogKeeper() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR && text_.size() < 1000) {
      text_ += (text_.empty() ? "" : "; ") + text;
    }
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct SilentLog {
  SilentLog() { console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE); }
  ~SilentLog() { console_bridge::setLogLevel(level); }
  const console_bridge::LogLevel level = console_bridge::getLogLevel();
};

/// Parses once, under the log's lock; what urdfdom complains of is an error.
urdf::ModelInterfaceSharedPtr ParseLoudly(const std::string& text) {
  LogKeeper log;
  const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
  if (!model) Fail(log.text().empty() ? "it cannot be parsed" : log.text());
  if (!log.text().empty()) Fail(log.text());
  return model;
}

urdf::ModelInterfaceSharedPtr ReadModel(const std::string& text) {
  CheckUrdfText(text);
  static std::mutex mutex;  // urdfdom's log is one for all threads
  const std::lock_guard<std::mutex> lock(mutex);
  try {
    if (text.find('%') == std::string::npos) return ParseLoudly(text);
    // urdfdom takes some texts of the file for format strings of its log: it only gets to complain
    // of a copy without them, and reads the file itself with its log shut.
    std::string harmless = text;
    std::replace(harmless.begin(), harmless.end(), '%', '_');
    ParseLoudly(harmless);
    const SilentLog silent;
    const urdf::ModelInterfaceSharedPtr model = urdf::parseURDF(text);
    if (!model) Fail("it cannot be parsed");
    return model;
  } catch (const std::invalid_argument&) {
    throw;
  } catch (const std::exception& error) {
    Fail(error.what());
  }
}

/// Links of a loop hold one another, and would never be freed.
struct LoopBreaker {
  const urdf::ModelInterfaceSharedPtr& model;
  ~LoopBreaker() {
    for (const auto& entry : model->links_) entry.second->child_links.clear();
  }
};

Vec3<double> ReadVector(const urdf::Vector3& v, const std::string& owner) {
  const Vec3<double> vector(v.x, v.y, v.z);
  if (!vector.allFinite()) Fail(owner + ": a number is not finite");
  return vector;
}

Pose ReadPose(const urdf::Pose& pose, const std::string& owner) {
  const double q[] = {pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z};
  const Mat3<double> rotation = QuaternionRotation(q);
  if (!rotation.allFinite()) Fail(owner + ": its rotation is not finite");
  return {rotation, ReadVector(pose.position, owner)};
}

BodyInertia ReadInertia(const urdf::Link& link) {
  if (!link.inertial) return BodyInertia();
  const urdf::Inertial& given = *link.inertial;
  const std::string owner = "link '" + link.name + "'";
  BodyInertia inertia;
  inertia.mass = given.mass;
  if (!(inertia.mass > 0) || !std::isfinite(inertia.mass)) {
    Fail(owner + ": its mass is " + std::to_string(given.mass) +
         ", expected more than 0 (leave out <inertial> for a link without mass)");
  }
  Mat3<double> I;
  I << given.ixx, given.ixy, given.ixz, given.ixy, given.iyy, given.iyz, given.ixz, given.iyz,
      given.izz;
  if (!I.allFinite()) Fail(owner + ": its inertia is not finite");
  if (!I.isZero(0)) {
    const Vec3<double> moments = Eigen::SelfAdjointEigenSolver<Mat3<double>>(I).eigenvalues();
    if (!(moments(0) > 0)) Fail(owner + ": its inertia is not positive definite");
    // A thin plate has equality: allow for the rounding of its decimal numbers.
    if (moments(2) > (moments(0) + moments(1)) * (1 + 1e-6)) {
      Fail(owner + ": no body has its inertia: the largest principal moment " +
           std::to_string(moments(2)) + " is more than the sum of the others, " +
           std::to_string(moments(0) + moments(1)));
    }
  }
  inertia.central = I;
  return inertia.In(ReadPose(given.origin, owner));
}

Vec3<double> ReadAxis(const urdf::Joint& joint, RobotModel* robot) {
  const std::string owner = "joint '" + joint.name + "'";
  const Vec3<double> axis = ReadVector(joint.axis, owner);
  const double length = axis.norm();
  if (!(length > 1e-6) || !std::isfinite(length)) Fail(owner + ": its axis has no direction");
  if (std::abs(length - 1) > 1e-3) {
    robot->warnings.push_back(owner + ": its axis has length " + std::to_string(length) +
                              "; only its direction is used");
  }
  return axis / length;
}

RobotModel::Mount AddJoint(const urdf::Joint& joint, const RobotModel::Mount& frame,
                           RobotModel* robot) {
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
      Fail("joint '" + joint.name + "' has no known type");
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

/// Every link has at most one parent joint, which urdfdom does not ask for; no mimic.
void CheckJoints(const urdf::ModelInterface& model) {
  std::set<std::string> children;
  for (const auto& entry : model.joints_) {
    const urdf::Joint& joint = *entry.second;
    if (joint.mimic) {
      Fail("joint '" + joint.name + "' mimics '" + joint.mimic->joint_name +
           "': mimic joints are not supported");
    }
    if (!children.insert(joint.child_link_name).second) {
      Fail("link '" + joint.child_link_name + "' is the child of two joints, one is '" +
           joint.name + "': close loops by closures instead");
    }
  }
}

void WarnOfUnused(const urdf::ModelInterface& model, RobotModel* robot) {
  std::string limits, losses;
  for (const auto& entry : model.joints_) {
    const urdf::Joint& joint = *entry.second;
    if (joint.type == urdf::Joint::FIXED) continue;
    if (joint.limits) limits += " '" + joint.name + "'";
    if (joint.dynamics && (joint.dynamics->damping != 0 || joint.dynamics->friction != 0)) {
      losses += " '" + joint.name + "'";
    }
  }
  if (!limits.empty()) {
    robot->warnings.push_back("the limits of these joints are not used; declare constraints:" +
                              limits);
  }
  if (!losses.empty()) {
    robot->warnings.push_back(
        "the damping and friction of these joints are not used; declare efforts:" + losses);
  }
}

void CheckNames(const RobotModel& robot) {
  std::set<std::string> names;
  for (const std::string& name : robot.coordinates) {
    if (!names.insert(name).second) Fail("two coordinates are called '" + name + "'");
  }
}

/// Adds the link and the joint it hangs on; returns where the link is.
RobotModel::Mount AddLink(const urdf::Link& link, const RobotModel::Mount& parent,
                          RobotModel* robot) {
  RobotModel::Mount mount = parent;
  if (link.parent_joint) {
    const urdf::Joint& joint = *link.parent_joint;
    const Pose origin =
        ReadPose(joint.parent_to_joint_origin_transform, "joint '" + joint.name + "'");
    mount = AddJoint(joint, {parent.body, parent.pose * origin}, robot);
  }
  robot->links.push_back({link.name, mount.body, mount.pose, ReadInertia(link)});
  return mount;
}

}  // namespace

RobotModel ParseUrdf(const std::string& text, RobotBase base) {
  const urdf::ModelInterfaceSharedPtr model = ReadModel(text);
  const LoopBreaker breaker{model};
  CheckJoints(*model);
  RobotModel robot;
  robot.name = model->getName();
  WarnOfUnused(*model, &robot);
  struct Visit {
    urdf::LinkConstSharedPtr link;
    RobotModel::Mount parent;
  };
  std::vector<Visit> open = {{model->getRoot(), AddBase(base, &robot)}};
  std::set<std::string> found;
  while (!open.empty()) {
    const Visit next = open.back();
    open.pop_back();
    const urdf::Link& link = *next.link;
    if (!found.insert(link.name).second) Fail("link '" + link.name + "' is in a loop");
    const RobotModel::Mount mount = AddLink(link, next.parent, &robot);
    for (std::size_t k = link.child_links.size(); k-- > 0;) {  // taken from the back
      open.push_back({link.child_links[k], mount});
    }
  }
  for (const auto& entry : model->links_) {
    if (found.count(entry.first) > 0) continue;
    Fail("link '" + entry.first + "' is not connected to the root '" + model->getRoot()->name +
         "'");
  }
  CheckNames(robot);
  robot.JoinInertias();
  try {
    robot.CheckMass();
  } catch (const std::invalid_argument& error) {
    Fail(error.what());
  }
  return robot;
}

}  // namespace contact_flow
