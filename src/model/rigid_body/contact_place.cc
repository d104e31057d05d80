// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/contact_place.h"

#include <algorithm>

#include "contact_flow/model/rigid_body/kinematics.h"

namespace contact_flow {

void PlaceContact(const RobotSystem& system, int i, const TreeState<double>& state,
                  const VectorRef& lambda, Vec3<double>* point, Vec3<double>* force) {
  const ConstraintElement& constraint = *system.robot().constraints[static_cast<std::size_t>(i)];
  const ElementParts& parts = constraint.parts;
  force->setZero();
  if (!constraint.Touches()) {
    const RigidBodyTree& tree = system.robot().model.tree;
    *point = state.body[static_cast<std::size_t>(tree.dof_body(parts.joints[0].v))].position;
    return;
  }
  double z[ElementMotion::kMaxSize] = {}, map[2 * ElementMotion::kMaxSize];
  double* next = z;
  for (const AttachedPoint& place : parts.points) {
    const Vec3<double> p = PointPosition(state, place.body, place.local);
    next = std::copy(p.data(), p.data() + 3, next);
  }
  for (const RobotModel::Coordinate& clock : parts.joints) {  // of a surface that moves: a slide
    const auto body = static_cast<std::size_t>(system.robot().model.tree.dof_body(clock.v));
    *next++ = state.body[body].position(0);
  }
  Vec3<double> arm;
  constraint.Place(z, &arm, force);
  *force *= lambda(i);
  *point = Vec3<double>(z[0], z[1], z[2]) + arm;
  if (constraint.slip.rows == 0) return;
  constraint.SlipMap(z, map);  // on the first point friction pushes as where it touches
  const int row = system.friction()[static_cast<std::size_t>(i)].row;
  for (int r = 0; r < constraint.slip.rows; ++r) {
    const double* tangent = map + r * parts.size();
    *force += lambda(row + r) * Vec3<double>(tangent[0], tangent[1], tangent[2]);
  }
}

}  // namespace contact_flow
