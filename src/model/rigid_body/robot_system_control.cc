// SPDX-License-Identifier: BSD-3-Clause
// What of a robot's efforts sees more than its own joints: feedback, weight, references.
#include "robot_scratch.h"

namespace contact_flow {
namespace {

/// (w, x, y, z) of q_ref⁻¹ ⊗ q.
Eigen::Vector4d Relative(const double* reference, const double* q) {
  const double *a = reference, *b = q;
  return {a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3],
          a[0] * b[1] - a[1] * b[0] - a[2] * b[3] + a[3] * b[2],
          a[0] * b[2] - a[2] * b[0] - a[3] * b[1] + a[1] * b[3],
          a[0] * b[3] - a[3] * b[0] - a[1] * b[2] + a[2] * b[1]};
}

}  // namespace

void StateFeedback::Error(const ConfigurationSpace& space, const VectorRef& position,
                          Vector* error) const {
  error->resize(space.dof());
  const std::vector<int>& lines = space.line_velocities();
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    if (lines[k] >= 0) (*error)(lines[k]) = position(i) - q(i);
  }
  for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
    const Eigen::Vector4d r = Relative(q.data() + rotation.q, position.data() + rotation.q);
    error->segment<3>(rotation.v) = 2 * r(0) * r.tail<3>();  // 2 cos(θ/2) sin(θ/2) n
  }
}

/// With (w, r) the relative quaternion, δw = −½ r·η and δr = ½ (w η + r × η).
void StateFeedback::ByTangents(const ConfigurationSpace& space, const VectorRef& position,
                               Matrix* product) const {
  for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
    const Eigen::Vector4d e = Relative(q.data() + rotation.q, position.data() + rotation.q);
    const Vec3<double> r = e.tail<3>();
    Mat3<double> change;
    for (int k = 0; k < 3; ++k) {
      const Vec3<double> unit = Vec3<double>::Unit(k);
      change.col(k) = e(0) * (e(0) * unit + Cross<double>(r, unit)) - r(k) * r;
    }
    for (Eigen::Index row = 0; row < product->rows(); ++row) {
      const Eigen::RowVector3d before = product->row(row).segment<3>(rotation.v);
      product->row(row).segment<3>(rotation.v) = before.lazyProduct(change);
    }
  }
}

void RobotSystem::CloseLoop(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                            Scratch* s) const {
  s->input = u;
  const StateFeedback& feedback = robot_.feedback;
  if (feedback.empty()) return;
  feedback.Error(space_, q, &s->error);
  s->input.noalias() -= feedback.gain_q * s->error;
  s->error = v - feedback.v;
  s->input.noalias() -= feedback.gain_v * s->error;
}

void RobotSystem::TakeInputs(int i, const ContactMode& mode, Scratch* s) const {
  const ElementParts& parts = robot_.efforts[static_cast<std::size_t>(i)]->parts;
  const std::size_t inputs = parts.inputs.size();
  for (std::size_t k = 0; k < inputs; ++k) s->u[k] = s->input(parts.inputs[k]);
  if (!parts.reference) return;
  s->u[inputs] = 0;
  for (int instant : parts.switches) s->u[inputs] += mode.Contains(instant) ? 1 : 0;
}

Vector RobotSystem::JointEfforts(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                 const ContactMode& mode) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  s->MoveTo(robot_.model.tree, q.data(), v.data());
  s->ClearForces();
  CloseLoop(q, v, u, s);
  AddEfforts(q, v, mode, s);
  return s->effort;
}

void RobotSystem::EffortShares(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                               const ContactMode& mode, Vector* share) const {
  const Loan loan(this);
  Scratch* s = loan.get();
  if (forces_on_points_) {
    s->MoveTo(robot_.model.tree, q.data(), v.data());
  }
  CloseLoop(q, v, u, s);
  share->resize(static_cast<Eigen::Index>(limited_.size()));
  for (std::size_t k = 0; k < limited_.size(); ++k) {
    const auto [i, by_speed] = limited_[k];
    const EffortElement& effort = *robot_.efforts[i];
    const ElementGeometry& geometry = effort_geometry_[i];
    geometry.Place(s->state, q.data(), &s->motion);
    geometry.Move(s->state, v.data(), &s->motion);
    TakeInputs(i, mode, s);
    const double *z = s->motion.z, *rate = s->motion.rate;
    (*share)(static_cast<Eigen::Index>(k)) =
        by_speed ? effort.SpeedShare(z, rate, s->u) : effort.Share(z, rate, s->u);
  }
}

void RobotSystem::Weigh(const VectorRef& q, Scratch* s) const {
  const RigidBodyTree& tree = robot_.model.tree;
  if (!s->resting) {
    s->resting = std::make_unique<TreeState<double>>(tree);
    s->weight.resize(tree.dof());
  }
  UpdatePositions(tree, q.data(), s->resting.get());
  UpdateVelocities(tree, s->zero.data(), s->resting.get());
  UpdateInertias(tree, s->resting.get());
  UpdateMomenta(tree, s->resting.get());
  InverseDynamics<double>(tree, tree.gravity(), nullptr, nullptr, s->resting.get(),
                          s->weight.data());
}

void RobotSystem::DifferentiateControl(const VectorRef& q, Scratch* s,
                                       ResidualJacobian* jacobian) const {
  const RigidBodyTree& tree = robot_.model.tree;
  if (robot_.weight_share.size() > 0) {  // of AddEfforts at this q
    s->weight_q.resize(tree.dof(), tree.dof());
    s->jacobian.Compute(tree, tree.gravity(), nullptr, *s->resting, s->weight_q.data(), nullptr);
    jacobian->momentum_q -= robot_.weight_share.asDiagonal() * s->weight_q;
  }
  const StateFeedback& feedback = robot_.feedback;
  if (feedback.empty()) return;
  s->chain = jacobian->momentum_u.lazyProduct(feedback.gain_q);
  feedback.ByTangents(space_, q, &s->chain);
  jacobian->momentum_q -= s->chain;
  jacobian->momentum_v -= jacobian->momentum_u.lazyProduct(feedback.gain_v);
}

}  // namespace contact_flow
