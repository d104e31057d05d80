// SPDX-License-Identifier: BSD-3-Clause
#include "guard_gradients.h"

namespace contact_flow {

GuardGradients::GuardGradients(ContactDynamics* dynamics, const VectorRef& x,
                               const ContactMode& mode, int trigger)
    : dynamics_(*dynamics),
      guards_(dynamics->system()),
      x_(x),
      mode_(mode),
      d_(dynamics->system().dof()) {
  const MechanicalSystem& system = dynamics->system();
  const Vector q = x.head(system.num_positions()), v = x.tail(d_);
  if (system.HasFriction()) EvaluateForces();
  system.Constraints(q, v, &terms_);
  const std::vector<int>& parameters = dynamics->variables().parameters;
  if (!parameters.empty()) {
    system.DifferentiateImpactByParameters(q, Vector::Zero(d_), Vector::Zero(system.num_rows()), v,
                                           parameters, &by_parameter_);
  }
  if (!system.HasFriction()) return;
  DifferentiateSlips(q, v);
  const bool watched = trigger < 0 || guards_.IsNormal(trigger) ||
                       (forces() | guards_.OfSlips(mode)).Contains(trigger);
  if (watched) return;
  ended_ = trigger;
  const int row = system.friction()[guards_.ConstraintOf(ended_)].row;
  const Eigen::Vector2d slip = rate_.segment<2>(row);
  speed_ = slip.norm();
  const Eigen::Vector2d direction = slip.normalized();
  along_ = direction.transpose() * rate_jacobian_.middleRows<2>(row);
  across_ = Eigen::RowVector2d(-direction.y(), direction.x()) * rate_jacobian_.middleRows<2>(row);
}

void GuardGradients::EvaluateForces() const {
  if (forces_known_) return;
  forces_known_ = true;
  dynamics_.Differentiate(x_, mode_);
  shared_ = dynamics_.shared();
  force_ = Vector::Zero(guards_.size());
  force_gradient_.resize(guards_.size(), dynamics_.force_jacobian().cols());
  for (int guard : forces() | (mode_ - dynamics_.system().compliant())) {
    force_(guard) = guards_.OfForce(guard, dynamics_);
    force_gradient_.row(guard) =
        guards_.GradientOfForce(guard, dynamics_, dynamics_.force_jacobian());
  }
  // The coefficient of friction is a factor of the cones.
  const std::vector<int>& parameters = dynamics_.variables().parameters;
  if (!parameters.empty() && dynamics_.system().HasFriction()) {
    const Matrix friction = dynamics_.system().DifferentiateFriction(parameters);
    for (int guard : forces()) {
      const int i = guards_.ConstraintOf(guard);
      if (guards_.IsNormal(guard) || shared_.Contains(i)) continue;
      force_gradient_.row(guard).tail(friction.cols()) += dynamics_.force()(i) * friction.row(i);
    }
  }
  field_ = dynamics_.Field(x_, mode_);
}

void GuardGradients::DifferentiateSlips(const Vector& q, const Vector& v) {
  const MechanicalSystem& system = dynamics_.system();
  const int rows = system.num_rows();
  rate_ = terms_.jacobian * v;
  ResidualJacobian by;
  system.DifferentiateImpact(q, Vector::Zero(d_), Vector::Zero(rows), v, &by);
  rate_jacobian_ = Matrix::Zero(rows, 2 * d_ + dynamics_.num_variables());
  rate_jacobian_.leftCols(2 * d_) << by.constraint_q, terms_.jacobian;
  if (by_parameter_.constraint.cols() > 0) {
    rate_jacobian_.rightCols(by_parameter_.constraint.cols()) = by_parameter_.constraint;
  }
}

GuardGradients::Value GuardGradients::At(int guard) const {
  switch (guards_.KindOf(guard, mode_, shared_)) {
    case GuardKind::kGap:
      return OfGap(guard);
    case GuardKind::kSlip:
      return OfSlip(guard);
    default:
      return OfForce(guard);
  }
}

GuardGradients::Value GuardGradients::OfForce(int guard) const {
  EvaluateForces();
  Value of_force{force_(guard), force_gradient_.row(guard)};
  if (!SlipInSpaceEnds()) return of_force;
  // The part that acts by ŝ is c D(e⊥·s), where velocities tell c: g_v tᵀ = c |t|², t = e⊥ᵀ T.
  const auto t = across_.segment(d_, d_);
  of_force.gradient -= of_force.gradient.segment(d_, d_).dot(t) / t.squaredNorm() * across_;
  return of_force;
}

GuardGradients::Value GuardGradients::OfGap(int i) const {
  const double sign = Guards::GapSign(i, mode_);
  Value gap{sign * terms_.gap(i), Eigen::RowVectorXd::Zero(2 * d_ + dynamics_.num_variables())};
  gap.gradient.head(d_) = sign * terms_.jacobian.row(i);
  const Matrix& by = by_parameter_.gap;
  if (by.cols() > 0) gap.gradient.tail(by.cols()) = sign * by.row(i);
  return gap;
}

GuardGradients::Value GuardGradients::OfSlip(int guard) const {
  if (guard == ended_) return {speed_, along_};
  const int i = guards_.ConstraintOf(guard);
  const Friction& friction = dynamics_.system().friction()[i];
  const auto slip = rate_.segment(friction.row, friction.dimension);
  Vector along = Vector::Constant(1, SlipSign(mode_.LetterOf(i)));
  if (friction.dimension == 2) along = slip / slip.norm();
  return {along.dot(slip),
          along.transpose() * rate_jacobian_.middleRows(friction.row, friction.dimension)};
}

}  // namespace contact_flow
