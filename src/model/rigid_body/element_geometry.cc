// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/element_geometry.h"

#include <algorithm>
#include <set>
#include <stdexcept>

#include "point_jacobian.h"

namespace contact_flow {
namespace {

Vec3<double> At(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

void Put(const Vec3<double>& vector, double* numbers) {
  for (int k = 0; k < 3; ++k) numbers[k] = vector(k);
}

}  // namespace

ElementRows::ElementRows(const RigidBodyTree& tree)
    : z_q(ElementMotion::kMaxSize, tree.dof()),
      rate_q(z_q.rows(), z_q.cols()),
      acceleration_q(z_q.rows(), z_q.cols()),
      acceleration_v(z_q.rows(), z_q.cols()),
      of_body(tree.dof()) {}

ElementGeometry::ElementGeometry(const RigidBodyTree& tree, const ElementParts& parts)
    : size_(parts.size()) {
  if (size_ > ElementMotion::kMaxSize) throw std::logic_error("an element has too many parts");
  std::set<int> dofs;
  const auto movers = [&](int body) {
    std::vector<Mover> found;
    for (int j = tree.last_dof(body); j >= 0; j = tree.dof_parent(j)) {
      dofs.insert(j);
      found.push_back({j, 0});
      const JointKind joint = tree.bodies()[tree.dof_body(j)].joint;
      if (joint == JointKind::kRevolute || joint == JointKind::kBall) affine_ = false;
    }
    return found;
  };
  for (const AttachedPoint& point : parts.points) points_.push_back({point, movers(point.body)});
  for (const RobotModel::Coordinate& joint : parts.joints) {
    joints_.push_back({joint, 0});
    dofs.insert(joint.v);
  }
  for (int body : parts.turns) turns_.push_back({body, movers(body)});
  columns_.assign(dofs.begin(), dofs.end());
  const auto column = [&](int dof) {
    return static_cast<int>(std::lower_bound(columns_.begin(), columns_.end(), dof) -
                            columns_.begin());
  };
  for (Point& point : points_) {
    for (Mover& mover : point.movers) mover.column = column(mover.dof);
  }
  for (Turn& turn : turns_) {
    for (Mover& mover : turn.movers) mover.column = column(mover.dof);
  }
  for (Joint& joint : joints_) joint.column = column(joint.place.v);
}

void ElementGeometry::Place(const TreeState<double>& state, const double* q,
                            ElementMotion* motion) const {
  double* z = motion->z;
  for (const Point& point : points_) {
    Put(PointPosition(state, point.place.body, point.place.local), z);
    z += 3;
  }
  for (const Joint& joint : joints_) *z++ = q[joint.place.q];
  std::fill(z, motion->z + size_, 0.0);
}

void ElementGeometry::Move(const TreeState<double>& state, const double* v,
                           ElementMotion* motion) const {
  int row = 0;
  for (const Point& point : points_) {
    Put(PointVelocity(state, point.place.body, At(motion->z + row)), motion->rate + row);
    row += 3;
  }
  for (const Joint& joint : joints_) motion->rate[row++] = v[joint.place.v];
  for (const Turn& turn : turns_) {
    const auto& body = state.body;
    Put(turn.body < 0 ? Vec3<double>::Zero() : body[turn.body].velocity.ang, motion->rate + row);
    row += 3;
  }
}

void ElementGeometry::Accelerate(const TreeState<double>& state, const Vec3<double>& gravity,
                                 const double* vdot, ElementMotion* motion) const {
  int row = 0;
  for (const Point& point : points_) {
    const int body = point.place.body;
    Vec3<double> acceleration = Vec3<double>::Zero();
    if (body >= 0) {
      Spatial<double> a = state.body[body].acceleration;
      a.lin += gravity;
      acceleration = PointAcceleration(state, body, a, At(motion->z + row));
    }
    Put(acceleration, motion->acceleration + row);
    row += 3;
  }
  for (const Joint& joint : joints_) {
    motion->acceleration[row++] = vdot == nullptr ? 0 : vdot[joint.place.v];
  }
  for (const Turn& turn : turns_) {
    const auto& body = state.body;
    Put(turn.body < 0 ? Vec3<double>::Zero() : body[turn.body].acceleration.ang,
        motion->acceleration + row);
    row += 3;
  }
}

void ElementGeometry::Columns(const TreeState<double>& state, const ElementMotion& motion,
                              ElementRows* rows) const {
  auto z_q = rows->z_q.topLeftCorner(size_, columns_.size());
  z_q.setZero();
  int row = 0;
  for (const Point& point : points_) {
    const Vec3<double> position = At(motion.z + row);
    for (const Mover& mover : point.movers) {
      z_q.block<3, 1>(row, mover.column) =
          PointColumn(state, point.place.body, mover.dof, position);
    }
    row += 3;
  }
  for (const Joint& joint : joints_) z_q(row++, joint.column) = 1;
  for (const Turn& turn : turns_) {
    for (const Mover& mover : turn.movers) {
      z_q.block<3, 1>(row, mover.column) = state.dof[mover.dof].axis.ang;
    }
    row += 3;
  }
}

void ElementGeometry::Differentiate(const RigidBodyTree& tree, const TreeState<double>& state,
                                    const Vec3<double>& gravity, const ElementMotion& motion,
                                    ElementRows* rows) const {
  const auto count = static_cast<Eigen::Index>(columns_.size());
  rows->z_q.topLeftCorner(size_, count).setZero();
  rows->rate_q.topLeftCorner(size_, count).setZero();
  rows->acceleration_q.topLeftCorner(size_, count).setZero();
  rows->acceleration_v.topLeftCorner(size_, count).setZero();
  int moved = -1, row = 0;
  const auto move = [&](int body, const std::vector<Mover>& movers) {
    if (body == moved) return;  // the place and the turn of one
    moved = body;
    for (std::size_t k = 0; k < movers.size(); ++k) {
      rows->of_body[k] = DifferentiateBody(tree, gravity, state, body, movers[k].dof);
    }
  };
  for (const Point& point : points_) {
    const int body = point.place.body;
    const PointMotion<double> at = {At(motion.z + row), At(motion.rate + row),
                                    At(motion.acceleration + row)};
    move(body, point.movers);
    for (std::size_t k = 0; k < point.movers.size(); ++k) {
      const Mover& mover = point.movers[k];
      const PointColumns<double> c =
          DifferentiatePoint(state, body, rows->of_body[k], at, mover.dof);
      rows->z_q.block<3, 1>(row, mover.column) = c.jacobian;
      rows->rate_q.block<3, 1>(row, mover.column) = c.velocity_q;
      rows->acceleration_q.block<3, 1>(row, mover.column) = c.acceleration_q;
      rows->acceleration_v.block<3, 1>(row, mover.column) = c.acceleration_v;
    }
    row += 3;
  }
  for (const Joint& joint : joints_) rows->z_q(row++, joint.column) = 1;
  for (const Turn& turn : turns_) {
    move(turn.body, turn.movers);
    for (std::size_t k = 0; k < turn.movers.size(); ++k) {
      const Mover& mover = turn.movers[k];
      const BodyColumns<double>& c = rows->of_body[k];
      rows->z_q.block<3, 1>(row, mover.column) = state.dof[mover.dof].axis.ang;
      rows->rate_q.block<3, 1>(row, mover.column) = c.velocity_q.ang;
      rows->acceleration_q.block<3, 1>(row, mover.column) = c.acceleration_q.ang;
      rows->acceleration_v.block<3, 1>(row, mover.column) = c.acceleration_v.ang;
    }
    row += 3;
  }
}

void ElementGeometry::Push(const TreeState<double>& state, const ElementMotion& motion,
                           const double* e, PointForces<double>* external, double* effort) const {
  int row = 0;
  for (const Point& point : points_) {
    if (point.place.body >= 0) {
      const Vec3<double> arm = At(motion.z + row) - state.body[point.place.body].reference;
      external[point.place.body].Add(arm, At(e + row));
    }
    row += 3;
  }
  for (const Joint& joint : joints_) effort[joint.place.v] += e[row++];
  for (const Turn& turn : turns_) {
    if (turn.body >= 0) external[turn.body].AddTorque(At(e + row));
    row += 3;
  }
}

}  // namespace contact_flow
