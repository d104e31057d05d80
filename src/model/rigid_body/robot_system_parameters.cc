// SPDX-License-Identifier: BSD-3-Clause
#include "robot_scratch.h"

namespace contact_flow {
namespace {

using Owner = NumberPlace::Owner;

/// ∂I/∂(number of a link) about the reference point, the numbers as in NumberPlace: exact, I being
/// linear in mass and central inertia and quadratic in the centre of mass.
struct InertiaChange {
  SpatialInertia<double> plus, minus;
  double factor;
};
InertiaChange ChangeInertia(const BodyInertia& inertia, int number, const Mat3<double>& rotation,
                            const Vec3<double>& com) {
  const Mat3<double> none = Mat3<double>::Zero();
  const SpatialInertia<double> zero = SpatialInertia<double>::Zero();
  if (number == 0) return {PlaceInertia<double>(1, none, rotation, com), zero, 1};
  if (number < 4) {
    const Vec3<double> step = rotation.col(number - 1);
    return {PlaceInertia<double>(inertia.mass, none, rotation, com + step),
            PlaceInertia<double>(inertia.mass, none, rotation, com - step), 0.5};
  }
  constexpr int kRow[] = {0, 0, 0, 1, 1, 2}, kColumn[] = {0, 1, 2, 1, 2, 2};
  Mat3<double> unit = none;
  const int row = kRow[number - 4], column = kColumn[number - 4];
  unit(row, column) = unit(column, row) = 1;
  return {PlaceInertia<double>(0, unit, rotation, com), zero, 1};
}

}  // namespace

void RobotSystem::DifferentiateInertia(const NumberPlace& place, bool weight,
                                       const TreeState<double>& state, double* column) const {
  const RigidBodyTree& tree = robot_.model.tree;
  if (place.owner == Owner::kGravity) {
    if (!weight) return;
    for (int j = 0; j < tree.dof(); ++j) column[j] += state.dof[j].momentum.lin(2);
    return;
  }
  const RobotModel::Link& link = robot_.model.links[place.index];
  if (link.body < 0) return;
  const TreeState<double>::Body& body = state.body[link.body];
  const Mat3<double> rotation = body.rotation * link.pose.rotation;
  const Vec3<double> com =
      body.position - body.reference + body.rotation * (link.pose * link.inertia.com);
  const InertiaChange change = ChangeInertia(link.inertia, place.number, rotation, com);
  const auto force = [&](const SpatialInertia<double>& inertia) {
    return inertia * body.acceleration + CrossForce(body.velocity, inertia * body.velocity);
  };
  const Spatial<double> f = change.factor * (force(change.plus) - force(change.minus));
  for (int j = tree.last_dof(link.body); j >= 0; j = tree.dof_parent(j)) {
    column[j] += Dot(state.dof[j].axis, f);
  }
}

void RobotSystem::DifferentiateConstraintByNumber(int i, int number, const VectorRef& q,
                                                  const VectorRef& v, const VectorRef& acceleration,
                                                  const VectorRef& force, Scratch* s, int column,
                                                  ParameterJacobian* jacobian) const {
  const ElementGeometry& geometry = constraint_geometry_[i];
  geometry.Place(s->state, q.data(), &s->motion);
  geometry.Move(s->state, v.data(), &s->motion);
  geometry.Accelerate(s->state, robot_.model.tree.gravity(), acceleration.data(), &s->motion);
  geometry.Columns(s->state, s->motion, &s->rows);
  const ConstraintElement::ByNumber change = constraint(i).DifferentiateByNumber(
      s->motion.z, s->motion.rate, s->motion.acceleration, number, s->e);
  jacobian->constraint(i, column) += change.acceleration;
  for (std::size_t c = 0; c < geometry.columns().size(); ++c) {
    for (int k = 0; k < constraint(i).size(); ++k) {
      jacobian->momentum(geometry.columns()[c], column) -= force(i) * s->e[k] * s->rows.z_q(k, c);
    }
  }
  if (constraint(i).slip.rows > 0) {
    DifferentiateSlipByNumber(i, number, force, nullptr, s, column, jacobian);
  }
}

void RobotSystem::DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v,
                                                    const VectorRef& u, const ContactMode& mode,
                                                    const VectorRef& acceleration,
                                                    const VectorRef& force,
                                                    const std::vector<int>& parameters,
                                                    ParameterJacobian* jacobian) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  jacobian->momentum.setZero(tree.dof(), count);
  jacobian->constraint.setZero(num_rows(), count);
  s->MoveTo(tree, q.data(), v.data());
  s->TakeInertias(tree);
  UpdateMomenta(tree, &s->state);
  UpdateAccelerations(tree, tree.gravity(), acceleration.data(), &s->state);
  CloseLoop(q, v, u, s);
  if (robot_.weight_share.size() > 0) Weigh(q, s);
  for (int p = 0; p < count; ++p) {
    for (const NumberPlace& place : robot_.parameters.at(parameters[p]).places) {
      switch (place.owner) {
        case Owner::kLink:
        case Owner::kGravity:
          DifferentiateInertia(place, true, s->state, jacobian->momentum.col(p).data());
          if (robot_.weight_share.size() == 0) break;
          s->weight.setZero();
          DifferentiateInertia(place, true, *s->resting, s->weight.data());
          jacobian->momentum.col(p) -= robot_.weight_share.cwiseProduct(s->weight);
          break;
        case Owner::kConstraint:
          DifferentiateConstraintByNumber(place.index, place.number, q, v, acceleration, force, s,
                                          p, jacobian);
          break;
        case Owner::kEffort: {
          const EffortElement& element = *robot_.efforts[place.index];
          const ElementGeometry& geometry = effort_geometry_[place.index];
          geometry.Place(s->state, q.data(), &s->motion);
          geometry.Move(s->state, v.data(), &s->motion);
          geometry.Columns(s->state, s->motion, &s->rows);
          TakeInputs(place.index, mode, s);
          element.DifferentiateByNumber(s->motion.z, s->motion.rate, s->u, place.number, s->e);
          for (std::size_t c = 0; c < geometry.columns().size(); ++c) {
            for (int k = 0; k < geometry.size(); ++k) {
              jacobian->momentum(geometry.columns()[c], p) -= s->e[k] * s->rows.z_q(k, c);
            }
          }
          break;
        }
        case Owner::kRestitution:
        case Owner::kFriction:  // of the law of contact, not of a residual
          break;
      }
    }
  }
}

void RobotSystem::DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                                  const VectorRef& impulse, const VectorRef& speed,
                                                  const std::vector<int>& parameters,
                                                  ParameterJacobian* jacobian) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  const RigidBodyTree& tree = robot_.model.tree;
  const auto count = static_cast<Eigen::Index>(parameters.size());
  jacobian->momentum.setZero(tree.dof(), count);
  jacobian->constraint.setZero(num_rows(), count);
  jacobian->gap.setZero(num_rows(), count);
  jacobian->restitution.setZero(num_constraints(), count);
  s->MoveTo(tree, q.data(), s->zero.data());
  s->TakeInertias(tree);
  UpdateMomenta(tree, &s->state);
  UpdateAccelerations<double>(tree, Vec3<double>::Zero(), jump.data(), &s->state);
  for (int p = 0; p < count; ++p) {
    for (const NumberPlace& place : robot_.parameters.at(parameters[p]).places) {
      if (place.owner == Owner::kEffort || place.owner == Owner::kFriction) continue;
      if (place.owner == Owner::kRestitution) {
        jacobian->restitution(place.index, p) = 1;
        continue;
      }
      if (place.owner != Owner::kConstraint) {
        DifferentiateInertia(place, false, s->state, jacobian->momentum.col(p).data());
        continue;
      }
      const int i = place.index;
      const ElementGeometry& geometry = constraint_geometry_[i];
      geometry.Place(s->state, q.data(), &s->motion);
      geometry.Columns(s->state, s->motion, &s->rows);
      const double still[ElementMotion::kMaxSize] = {};
      jacobian->gap(i, p) +=
          constraint(i).DifferentiateByNumber(s->motion.z, still, still, place.number, s->e).gap;
      for (std::size_t c = 0; c < geometry.columns().size(); ++c) {
        const int j = geometry.columns()[c];
        for (int k = 0; k < constraint(i).size(); ++k) {
          const double change = s->e[k] * s->rows.z_q(k, c);
          jacobian->momentum(j, p) -= impulse(i) * change;
          jacobian->constraint(i, p) += change * speed(j);
        }
      }
      if (constraint(i).slip.rows > 0) {
        DifferentiateSlipByNumber(i, place.number, impulse, speed.data(), s, p, jacobian);
      }
    }
  }
}

}  // namespace contact_flow
