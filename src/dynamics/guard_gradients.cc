// SPDX-License-Identifier: BSD-3-Clause
#include "guard_gradients.h"

namespace contact_flow {

GuardGradients::GuardGradients(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                               int trigger)
    : guards_(dynamics->system()), mode_(mode) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions(), rows = system.num_rows();
  const Vector q = x.head(nq), v = x.tail(d);
  dynamics->Differentiate(x, mode);
  forces_ = guards_.OfForces(mode, dynamics->shared());
  const Matrix force_jacobian = dynamics->force_jacobian().leftCols(2 * d);
  force_ = Vector::Zero(guards_.size());
  force_gradient_.resize(guards_.size(), 2 * d);
  for (int guard : forces_) {
    force_(guard) = guards_.OfForce(guard, *dynamics);
    force_gradient_.row(guard) = guards_.GradientOfForce(guard, *dynamics, force_jacobian);
  }
  field_ = dynamics->Field(x, mode).head(2 * d);
  system.Constraints(q, v, &terms_);
  rate_ = terms_.jacobian * v;
  ResidualJacobian by;
  system.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(rows), v, &by);
  rate_jacobian_.resize(rows, 2 * d);
  rate_jacobian_ << by.constraint_q, terms_.jacobian;
  if (guards_.IsNormal(trigger) || (forces_ | guards_.OfSlips(mode)).Contains(trigger)) return;
  ended_ = trigger;
  const int row = guards_.SlipRow(ended_);
  const Eigen::Vector2d slip = rate_.segment<2>(row);
  speed_ = slip.norm();
  const Eigen::Vector2d direction = slip.normalized();
  along_ = direction.transpose() * rate_jacobian_.middleRows<2>(row);
  across_ = Eigen::RowVector2d(-direction.y(), direction.x()) * rate_jacobian_.middleRows<2>(row);
}

GuardGradients::Value GuardGradients::At(int guard) const {
  const Eigen::Index d = terms_.jacobian.cols();
  if (guard == ended_) return {speed_, along_};
  if (forces_.Contains(guard)) {
    Value of_force{force_(guard), force_gradient_.row(guard)};
    if (!SlipInSpaceEnds()) return of_force;
    // The part that acts by ŝ is c D(e⊥·s), where velocities tell c: g_v tᵀ = c |t|², t = e⊥ᵀ T.
    const auto t = across_.tail(d);
    of_force.gradient -= of_force.gradient.tail(d).dot(t) / t.squaredNorm() * across_;
    return of_force;
  }
  if (guards_.IsNormal(guard)) {
    Value gap{terms_.gap(guard), Eigen::RowVectorXd::Zero(2 * d)};
    gap.gradient.head(d) = terms_.jacobian.row(guard);
    return gap;
  }
  const double sign = guards_.SlipSign(guard, mode_);
  const int row = guards_.SlipRow(guard);
  return {sign * rate_(row), sign * rate_jacobian_.row(row)};
}

}  // namespace contact_flow
