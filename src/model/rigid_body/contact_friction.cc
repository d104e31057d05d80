// SPDX-License-Identifier: BSD-3-Clause
#include "contact_friction.h"

#include <cmath>
#include <set>
#include <stdexcept>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {
namespace {

/// Sine of an angle between axes that a URDF's rounding leaves.
constexpr double kParallel = 1e-9;

/// The normal of the plane that all these freedoms stay in, or zero. At rest is enough: what turns
/// about parallel axes keeps them, and keeps directions across them across.
Vec3<double> PlaneOf(const RigidBodyTree& tree, const std::set<int>& freedoms) {
  TreeState<double> state(tree);
  UpdatePositions(tree, tree.Neutral().data(), &state);
  Vec3<double> normal = Vec3<double>::Zero(), slide = Vec3<double>::Zero();
  for (int j : freedoms) {
    const int b = tree.dof_body(j);
    const Vec3<double> axis = state.body[b].rotation.col(2);
    switch (tree.bodies()[b].joint) {
      case JointKind::kRevolute:
        if (normal.isZero(0)) normal = axis;
        if (Cross<double>(normal, axis).norm() > kParallel) return Vec3<double>::Zero();
        break;
      case JointKind::kPrismatic:
        if (slide.isZero(0)) slide = axis;
        break;
      default:
        return Vec3<double>::Zero();
    }
  }
  for (int pass = 0; pass < 2; ++pass) {  // without a turn, two slides span the plane
    for (int j : freedoms) {
      const int b = tree.dof_body(j);
      if (tree.bodies()[b].joint != JointKind::kPrismatic) continue;
      const Vec3<double> axis = state.body[b].rotation.col(2), across = Cross<double>(axis, slide);
      if (normal.isZero(0) && across.norm() > kParallel) normal = across.normalized();
      if (pass == 1 && std::abs(normal.dot(axis)) > kParallel) return Vec3<double>::Zero();
    }
  }
  return normal;
}

}  // namespace

SlipFrame FindSlipFrame(const RobotModel& model, const ElementParts& parts) {
  if (parts.points.empty()) return {1, Vec3<double>::Zero()};  // of joints alone
  std::set<int> freedoms;
  for (const AttachedPoint& point : parts.points) {
    for (int j = model.tree.last_dof(point.body); j >= 0; j = model.tree.dof_parent(j)) {
      freedoms.insert(j);
    }
  }
  SlipFrame frame;
  frame.plane = PlaneOf(model.tree, freedoms);
  frame.rows = frame.plane.isZero(0) ? 2 : 1;
  if (static_cast<int>(freedoms.size()) < 1 + frame.rows) {
    throw std::invalid_argument(
        "'" + parts.name + "' cannot have friction: " + std::to_string(freedoms.size()) +
        (freedoms.size() == 1 ? " freedom moves" : " freedoms move") +
        " it, and to touch and slip takes " + std::to_string(1 + frame.rows));
  }
  const Vec3<double>& m = frame.plane;
  if (m(1) < -kParallel || (std::abs(m(1)) <= kParallel && m(0) > 0)) frame.plane = -m;
  return frame;
}

void GiveFriction(const RobotModel& model, double coefficient, ConstraintElement* element) {
  if (!element->MaySlip()) {
    throw std::invalid_argument("'" + element->parts.name +
                                "' cannot have friction: it is no contact of two surfaces");
  }
  element->no_slip = coefficient == Friction::kNoSlip;
  element->friction.value = element->no_slip ? 0 : coefficient;
  element->AddFriction(FindSlipFrame(model, element->parts));
}

}  // namespace contact_flow
