// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_traits.h"

#include <algorithm>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

bool IsSingle(const urdf::Joint& joint) {
  return joint.type == urdf::Joint::REVOLUTE || joint.type == urdf::Joint::CONTINUOUS ||
         joint.type == urdf::Joint::PRISMATIC;
}

/// Complains of mimic joints that follow themselves by way of others.
void CheckMimicRings(const std::vector<RobotModel::Mimic>& mimics, Findings* findings) {
  for (const RobotModel::Mimic& first : mimics) {
    std::string at = first.master;
    for (std::size_t steps = 0; steps <= mimics.size() && at != first.joint; ++steps) {
      for (const auto& other : mimics) {
        if (other.joint == at && at != first.joint) at = other.master;
      }
    }
    if (at != first.joint) continue;
    findings->errors.push_back("joint '" + first.joint + "' mimics itself by way of '" +
                               first.master + "': leave out the <mimic> of the joint that leads");
    return;
  }
}

}  // namespace

void ReadTraits(const urdf::ModelInterface& model, RobotModel* robot) {
  for (const auto& entry : model.joints_) {
    const urdf::Joint& joint = *entry.second;
    if (!IsSingle(joint)) continue;
    RobotModel::JointTraits traits;
    traits.name = joint.name;
    if (joint.limits) {
      traits.limited = joint.type != urdf::Joint::CONTINUOUS;
      traits.lower = joint.limits->lower;
      traits.upper = joint.limits->upper;
      traits.effort = std::max(0., joint.limits->effort);
      traits.speed = std::max(0., joint.limits->velocity);
    }
    if (joint.dynamics) {
      traits.damping = joint.dynamics->damping;
      traits.friction = joint.dynamics->friction;
    }
    robot->traits.push_back(traits);
  }
}

void ReadMimics(const urdf::ModelInterface& model, RobotModel* robot, Findings* findings) {
  std::vector<std::string> names;
  for (const auto& entry : model.joints_) names.push_back(entry.first);
  for (const auto& entry : model.joints_) {
    const urdf::Joint& joint = *entry.second;
    if (!joint.mimic || joint.type == urdf::Joint::FIXED) continue;
    const std::string owner = "joint '" + joint.name + "'";
    const auto master = model.joints_.find(joint.mimic->joint_name);
    if (master == model.joints_.end()) {
      findings->errors.push_back(owner + " mimics '" + joint.mimic->joint_name +
                                 "': " + UnknownName("joint", joint.mimic->joint_name, names));
    } else if (joint.name == master->first) {
      findings->errors.push_back(owner +
                                 " mimics itself: leave its <mimic> out, or name the joint "
                                 "that it follows");
    } else if (!IsSingle(joint)) {
      findings->errors.push_back(owner + " mimics '" + master->first +
                                 "': only revolute and prismatic joints can follow another joint");
    } else if (!IsSingle(*master->second) && master->second->type != urdf::Joint::FIXED) {
      findings->errors.push_back(owner + " mimics '" + master->first +
                                 "', which has several freedoms: give <mimic> a revolute or "
                                 "prismatic joint");
    } else {
      robot->mimics.push_back(
          {joint.name, master->first, joint.mimic->multiplier, joint.mimic->offset});
    }
  }
  CheckMimicRings(robot->mimics, findings);
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
    robot->warnings.push_back("the limits of these joints are used where 'joints' asks for them:" +
                              limits);
  }
  if (!losses.empty()) {
    robot->warnings.push_back(
        "the damping and friction of these joints are used where 'joints' asks for them:" + losses);
  }
}

}  // namespace contact_flow
