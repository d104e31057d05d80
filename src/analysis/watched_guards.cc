// SPDX-License-Identifier: BSD-3-Clause
#include "watched_guards.h"

namespace contact_flow {

using Limit = ValidityRadius::Limit;

WatchedGuards::WatchedGuards(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode)
    : dynamics_(*dynamics), system_(dynamics->system()), mode_(mode), numbers_(system_) {
  dynamics->Evaluate(x, mode);
  const ContactMode pressing = mode.Without(system_.compliant());
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (!pressing.Contains(i)) guards_.push_back({i, i, Limit::kGap});
  }
  for (int guard : numbers_.OfForces(mode, dynamics->shared())) {
    guards_.push_back({guard, numbers_.ConstraintOf(guard),
                       numbers_.IsNormal(guard) ? Limit::kForce : Limit::kCone});
  }
  for (int i : pressing - pressing.Sticking()) {
    const Friction& friction = system_.friction()[i];
    const bool turns = friction.dimension == 2 && friction.coefficient > 0;
    if (turns || mode.SlippingInPlane().Contains(i)) {
      guards_.push_back({numbers_.OfFriction(i), i, Limit::kSlip});
    }
  }
}

WatchedGuards::Values WatchedGuards::At(const VectorRef& x) const {
  const int d = system_.dof(), nq = system_.num_positions(), rows = system_.num_rows();
  const Vector q = x.head(nq), v = x.tail(d);
  const auto size = static_cast<Eigen::Index>(guards_.size());
  const std::vector<int>& parameters = dynamics_.variables().parameters;
  dynamics_.Differentiate(x, mode_);
  Values at;
  at.value.resize(size);
  at.gradient = Matrix::Zero(size, 2 * d + dynamics_.num_variables());
  ConstraintTerms terms;
  system_.Constraints(q, v, &terms);
  ResidualJacobian by;
  system_.DifferentiateImpact(q, Vector::Zero(d), Vector::Zero(rows), v, &by);
  ParameterJacobian by_parameter;
  Matrix friction_by_parameter;
  if (!parameters.empty()) {
    system_.DifferentiateImpactByParameters(q, Vector::Zero(d), Vector::Zero(rows), v, parameters,
                                            &by_parameter);
    friction_by_parameter = system_.DifferentiateFriction(parameters);
  }
  const auto count = static_cast<Eigen::Index>(parameters.size());
  for (Eigen::Index k = 0; k < size; ++k) {
    const Guard& guard = guards_[static_cast<std::size_t>(k)];
    const int i = guard.constraint;
    auto gradient = at.gradient.row(k);
    if (guard.limit == Limit::kGap) {
      const double sign = mode_.Contains(i) ? -1 : 1;  // a depth where it is pressed
      at.value(k) = sign * terms.gap(i);
      gradient.head(d) = sign * terms.jacobian.row(i);
      if (count > 0) gradient.tail(count) = sign * by_parameter.gap.row(i);
    } else if (guard.limit == Limit::kSlip) {
      const Friction& friction = system_.friction()[i];
      const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * v;
      Vector along = Vector::Constant(1, numbers_.SlipSign(guard.number, mode_));
      if (friction.dimension == 2) along = slip / slip.norm();
      at.value(k) = along.dot(slip);
      const auto part = [&](const Matrix& whole) {
        return along.transpose() * whole.middleRows(friction.row, friction.dimension);
      };
      gradient.head(d) = part(by.constraint_q);
      gradient.segment(d, d) = part(terms.jacobian);
      if (count > 0) gradient.tail(count) = part(by_parameter.constraint);
    } else {
      at.value(k) = numbers_.OfForce(guard.number, dynamics_);
      gradient = numbers_.GradientOfForce(guard.number, dynamics_, dynamics_.force_jacobian());
      if (count > 0 && guard.limit == Limit::kCone && !dynamics_.shared().Contains(i)) {
        gradient.tail(count) += dynamics_.force()(i) * friction_by_parameter.row(i);
      }
    }
  }
  if (dynamics_.force().size() > 0) at.force = dynamics_.force().cwiseAbs().maxCoeff();
  at.field = dynamics_.Field(x, mode_);
  at.rate = at.gradient * at.field;
  return at;
}

}  // namespace contact_flow
