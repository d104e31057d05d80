// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "robot_scratch.h"

namespace contact_flow {
namespace {

using Block = Eigen::Map<const Matrix>;

}  // namespace

void RobotSystem::AddConstraintForces(const VectorRef& q, const VectorRef& force,
                                      Scratch* s) const {
  for (int i = 0; i < static_cast<int>(all_constraints_.size()); ++i) {
    const int row = slip_row(i), rows = constraint(i).slip.rows;
    if (force(i) == 0 && (rows == 0 || force.segment(row, rows).isZero(0))) continue;
    const ElementGeometry& geometry = constraint_geometry_[i];
    geometry.Place(s->state, q.data(), &s->motion);
    constraint(i).Gap(s->motion.z, s->e);
    for (int k = 0; k < constraint(i).size(); ++k) s->e[k] *= force(i);
    if (rows > 0) {
      const int size = geometry.size();
      std::fill(s->e + constraint(i).size(), s->e + size, 0.0);
      constraint(i).SlipMap(s->motion.z, s->slip_map);
      for (int r = 0; r < rows; ++r) {
        for (int k = 0; k < size; ++k) s->e[k] += force(row + r) * s->slip_map[r * size + k];
      }
    }
    geometry.Push(s->state, s->motion, s->e, s->external.data(), s->effort.data());
  }
}

/// − ∂(Zᵀ e)/∂(η, v, u) at fixed Z: Z itself is differentiated along the tree.
void RobotSystem::DifferentiateEffort(int i, const VectorRef& q, const VectorRef& v,
                                      const ContactMode& mode, Scratch* s,
                                      ResidualJacobian* jacobian) const {
  const EffortElement& element = *robot_.efforts[i];
  const ElementGeometry& geometry = effort_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const auto count = static_cast<Eigen::Index>(columns.size());
  const int size = geometry.size();
  geometry.Place(s->state, q.data(), &s->motion);
  geometry.Move(s->state, v.data(), &s->motion);
  const int inputs = static_cast<int>(element.parts.inputs.size());
  TakeInputs(i, mode, s);
  element.Differentiate(s->motion.z, s->motion.rate, s->u, s->e, s->by_z, s->by_rate,
                        s->by_u.data());
  if (element.parts.points.empty()) {  // each joint is its own column
    for (int row = 0; row < size; ++row) {
      const int j = element.parts.joints[row].v;
      for (int k = 0; k < size; ++k) {
        const int other = element.parts.joints[k].v;
        jacobian->momentum_q(j, other) -= s->by_z[row + k * size];
        jacobian->momentum_v(j, other) -= s->by_rate[row + k * size];
      }
      for (int k = 0; k < inputs; ++k) {
        jacobian->momentum_u(j, element.parts.inputs[k]) -= s->by_u[row + k * size];
      }
    }
    return;
  }
  geometry.Accelerate(s->state, robot_.model.tree.gravity(), nullptr, &s->motion);
  geometry.Differentiate(robot_.model.tree, s->state, robot_.model.tree.gravity(), s->motion,
                         &s->rows);
  const auto z_q = s->rows.z_q.topLeftCorner(size, count);
  const auto rate_q = s->rows.rate_q.topLeftCorner(size, count);
  const Block by_z(s->by_z, size, size), by_rate(s->by_rate, size, size),
      by_u(s->by_u.data(), size, inputs);
  auto change = s->product.topLeftCorner(size, count);
  const auto subtract = [&](Matrix* target) {
    for (Eigen::Index c = 0; c < count; ++c) {
      for (Eigen::Index r = 0; r < count; ++r) {
        (*target)(columns[r], columns[c]) -= z_q.col(r).dot(change.col(c));
      }
    }
  };
  change = by_z.lazyProduct(z_q) + by_rate.lazyProduct(rate_q);
  subtract(&jacobian->momentum_q);
  change = by_rate.lazyProduct(z_q);
  subtract(&jacobian->momentum_v);
  for (int k = 0; k < inputs; ++k) {
    for (Eigen::Index r = 0; r < count; ++r) {
      jacobian->momentum_u(columns[r], element.parts.inputs[k]) -= z_q.col(r).dot(by_u.col(k));
    }
  }
}

void RobotSystem::DifferentiateConstraint(int i, const VectorRef& q, const VectorRef& v,
                                          const VectorRef& acceleration, const VectorRef& force,
                                          Scratch* s, ResidualJacobian* jacobian) const {
  const ConstraintElement& element = constraint(i);
  const ElementGeometry& geometry = constraint_geometry_[i];
  const std::vector<int>& columns = geometry.columns();
  const auto count = static_cast<Eigen::Index>(columns.size());
  const int size = element.size();
  const double lambda = force(i);
  const RigidBodyTree& tree = robot_.model.tree;
  geometry.Place(s->state, q.data(), &s->motion);
  geometry.Move(s->state, v.data(), &s->motion);
  geometry.Accelerate(s->state, tree.gravity(), acceleration.data(), &s->motion);
  geometry.Differentiate(tree, s->state, tree.gravity(), s->motion, &s->rows);
  if (element.slip.rows > 0) DifferentiateSlip(i, force, s, jacobian);
  double *gradient = s->e, *hessian = s->by_z, *by_z = s->number, *by_rate = s->by_rate;
  element.Gap(s->motion.z, gradient);
  const ElementRows& rows = s->rows;
  for (Eigen::Index c = 0; c < count; ++c) {
    double by_q = 0, by_v = 0;
    for (int k = 0; k < size; ++k) {
      by_q += gradient[k] * rows.acceleration_q(k, c);
      by_v += gradient[k] * rows.acceleration_v(k, c);
    }
    jacobian->constraint_q(i, columns[c]) = by_q;
    jacobian->constraint_v(i, columns[c]) = by_v;
  }
  if (element.IsAffine()) return;
  element.Differentiate(s->motion.z, s->motion.rate, s->motion.acceleration, lambda, hessian, by_z,
                        by_rate);
  const auto z_q = rows.z_q.topLeftCorner(size, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    for (int k = 0; k < size; ++k) {
      jacobian->constraint_q(i, columns[c]) +=
          by_z[k] * rows.z_q(k, c) + by_rate[k] * rows.rate_q(k, c);
      jacobian->constraint_v(i, columns[c]) += by_rate[k] * rows.z_q(k, c);
    }
  }
  if (lambda == 0) return;
  auto change = s->product.topLeftCorner(size, count);
  change = Block(hessian, size, size).lazyProduct(z_q);
  for (Eigen::Index c = 0; c < count; ++c) {
    for (Eigen::Index r = 0; r < count; ++r) {
      jacobian->momentum_q(columns[r], columns[c]) -= z_q.col(r).dot(change.col(c));
    }
  }
}

void RobotSystem::DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                        const ContactMode& mode, const VectorRef& acceleration,
                                        const VectorRef& force, ResidualJacobian* jacobian) const {
  FillJacobian(nullptr, q, v, u, mode, acceleration, force, jacobian);
}

void RobotSystem::DifferentiateDynamicsOfMode(const VectorRef& q, const VectorRef& v,
                                              const VectorRef& u, const ContactMode& mode,
                                              const VectorRef& acceleration, const VectorRef& force,
                                              ResidualJacobian* jacobian) const {
  FillJacobian(&mode.Members(), q, v, u, mode, acceleration, force, jacobian);
}

void RobotSystem::FillJacobian(const ConstraintSet* asked, const VectorRef& q, const VectorRef& v,
                               const VectorRef& u, const ContactMode& mode,
                               const VectorRef& acceleration, const VectorRef& force,
                               ResidualJacobian* jacobian) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  const int n = tree.dof();
  s->MoveTo(tree, q.data(), v.data());
  s->TakeInertias(tree);
  UpdateMomenta(tree, &s->state);
  s->ClearForces();
  CloseLoop(q, v, u, s);
  AddEfforts(q, v, mode, s);
  AddConstraintForces(q, force, s);
  InverseDynamics(tree, tree.gravity(), acceleration.data(), s->external.data(), &s->state,
                  s->tau.data());
  jacobian->momentum_q.resize(n, n);
  jacobian->momentum_v.resize(n, n);
  jacobian->momentum_u.setZero(n, num_inputs());
  jacobian->constraint_q.setZero(num_rows(), n);
  jacobian->constraint_v.setZero(num_rows(), n);
  s->jacobian.Compute(tree, tree.gravity(), s->external.data(), s->state,
                      jacobian->momentum_q.data(), jacobian->momentum_v.data());
  for (std::size_t i = 0; i < robot_.efforts.size(); ++i) {
    DifferentiateEffort(static_cast<int>(i), q, v, mode, s, jacobian);
  }
  DifferentiateControl(q, s, jacobian);
  VisitConstraints(
      asked, [&](int i) { DifferentiateConstraint(i, q, v, acceleration, force, s, jacobian); });
}

void RobotSystem::DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                      const VectorRef& impulse, const VectorRef& speed,
                                      ResidualJacobian* jacobian) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  const int n = tree.dof(), count = static_cast<int>(all_constraints_.size());
  const Vec3<double> weightless = Vec3<double>::Zero();
  s->MoveTo(tree, q.data(), s->zero.data());
  s->TakeInertias(tree);
  UpdateMomenta(tree, &s->state);
  s->ClearForces();
  AddConstraintForces(q, impulse, s);
  InverseDynamics(tree, weightless, jump.data(), s->external.data(), &s->state, s->tau.data());
  jacobian->momentum_q.resize(n, n);
  s->jacobian.Compute(tree, weightless, s->external.data(), s->state, jacobian->momentum_q.data(),
                      nullptr);
  jacobian->constraint_q.setZero(num_rows(), n);
  s->MoveTo(tree, q.data(), speed.data());
  UpdateAccelerations<double>(tree, weightless, nullptr, &s->state);
  for (int i = 0; i < count; ++i) {
    const ConstraintElement& element = constraint(i);
    const ElementGeometry& geometry = constraint_geometry_[i];
    const std::vector<int>& columns = geometry.columns();
    const auto width = static_cast<Eigen::Index>(columns.size());
    const int size = element.size();
    geometry.Place(s->state, q.data(), &s->motion);
    geometry.Move(s->state, speed.data(), &s->motion);
    geometry.Accelerate(s->state, weightless, nullptr, &s->motion);
    geometry.Differentiate(tree, s->state, weightless, s->motion, &s->rows);
    if (element.slip.rows > 0) DifferentiateSlipAtImpact(i, impulse, s, jacobian);
    double *gradient = s->e, *hessian = s->by_z;
    element.Gap(s->motion.z, gradient);
    // Both λ H and 2 H ż, the derivative of curvature by ż.
    element.Differentiate(s->motion.z, s->motion.rate, s->motion.acceleration, impulse(i), hessian,
                          s->number, s->by_rate);
    const auto z_q = s->rows.z_q.topLeftCorner(size, width);
    for (Eigen::Index c = 0; c < width; ++c) {
      double sum = 0;
      for (int k = 0; k < size; ++k) {
        sum += gradient[k] * s->rows.rate_q(k, c) + 0.5 * s->by_rate[k] * z_q(k, c);
      }
      jacobian->constraint_q(i, columns[c]) = sum;
    }
    if (element.IsAffine() || impulse(i) == 0) continue;
    auto change = s->product.topLeftCorner(size, width);
    change = Block(hessian, size, size).lazyProduct(z_q);
    for (Eigen::Index c = 0; c < width; ++c) {
      for (Eigen::Index r = 0; r < width; ++r) {
        jacobian->momentum_q(columns[r], columns[c]) -= z_q.col(r).dot(change.col(c));
      }
    }
  }
}

}  // namespace contact_flow
