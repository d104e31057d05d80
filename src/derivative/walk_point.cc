// SPDX-License-Identifier: BSD-3-Clause
#include "walk_point.h"

#include <cmath>

#include "frictional_reset.h"
#include "src/dynamics/slips_in_space.h"
#include "src/flow/force_slack.h"

namespace contact_flow {
namespace {

/// A slip, or a normal velocity, is zero below this, relative to its terms.
constexpr double kZero = 1e-9;
/// A slip that the impact leaves where none was before, relative to its terms.
constexpr double kStruck = 1e-12;
/// A force that vanishes is known to, relative to the largest.
constexpr double kNoForce = 1e-7;

ConstraintSet Struck(const MechanicalSystem& system, const Transition& transition) {
  if (transition.activated.Empty()) return {};
  return (SlipsInSpace(system, transition.impulse_word) &
          SlipsInSpace(system, transition.mode_after)) -
         SlipsInSpace(system, transition.mode_before);
}

}  // namespace

WalkPoint::WalkPoint(ContactDynamics* dynamics, const Transition& transition)
    : dynamics_(*dynamics),
      system_(dynamics->system()),
      nq_(system_.num_positions()),
      contacts_(transition.mode_before.Members() | transition.activated),
      struck_(Struck(system_, transition)),
      speed_(transition.x_minus.tail(system_.dof()).cwiseAbs().maxCoeff()),
      x_(transition.x_minus) {
  Measure();
}

void WalkPoint::MoveTo(const Vector& x) {
  x_ = x;
  Measure();
}

void WalkPoint::Measure() {
  const int d = system_.dof();
  system_.Constraints(x_.head(nq_), v(), &terms_);
  rate_ = terms_.jacobian * v();
  rate_jacobian_ = RateJacobian(dynamics_, x_);
  acceleration_ = LargestAcceleration(dynamics_, x_, contacts_);
  gap_jacobian_ = Matrix::Zero(system_.num_rows(), 2 * d + dynamics_.num_variables());
  gap_jacobian_.leftCols(d) = terms_.jacobian;
  const std::vector<int>& parameters = dynamics_.variables().parameters;
  if (parameters.empty()) return;
  ParameterJacobian by_parameter;
  system_.DifferentiateImpactByParameters(x_.head(nq_), Vector::Zero(d),
                                          Vector::Zero(system_.num_rows()), v(), parameters,
                                          &by_parameter);
  gap_jacobian_.rightCols(by_parameter.gap.cols()) = by_parameter.gap;
}

double WalkPoint::SizeOf(int row) const {
  const auto terms = terms_.jacobian.row(row).cwiseAbs();
  return terms.dot(v().cwiseAbs()) + speed_ * terms.maxCoeff();
}

bool WalkPoint::SlipVanishes(int i) const {
  const Friction& friction = system_.friction()[i];
  const double zero = struck_.Contains(i) ? kStruck : kZero;
  return rate_.segment(friction.row, friction.dimension).norm() <= zero * SizeOf(friction.row);
}

int WalkPoint::Leaves(int i) const {
  const double border = kZero * SizeOf(i);
  return (rate_(i) > border) - (rate_(i) < -border);
}

ConstraintSet WalkPoint::Forceless(ContactMode mode, ConstraintSet among) const {
  if (among.Empty()) return among;
  dynamics_.Evaluate(x_, mode);
  const Vector force = dynamics_.force().cwiseAbs();
  ConstraintSet forceless;
  for (int i : among) {
    if (force(i) <= kNoForce * force.maxCoeff()) forceless.Insert(i);
  }
  return forceless;
}

ConstraintSet WalkPoint::AtCone(ContactMode mode) const {
  dynamics_.Evaluate(x_, mode);
  const Vector& force = dynamics_.force();
  const double border = kNoForce * force.cwiseAbs().maxCoeff();
  ConstraintSet at_cone;
  for (int i : mode.Sticking()) {
    const Friction& friction = system_.friction()[i];
    if (friction.dimension != 1 || std::isinf(friction.coefficient)) continue;
    const double lacks = friction.coefficient * force(i) - std::abs(force(friction.row));
    if (force(i) > border && std::abs(lacks) <= border) at_cone.Insert(i);
  }
  return at_cone;
}

Eigen::RowVectorXd WalkPoint::ConeGradient(ContactMode mode, int i) const {
  const Friction& friction = system_.friction()[i];
  dynamics_.Differentiate(x_, mode);
  const Matrix& D = dynamics_.force_jacobian();
  const double sign = dynamics_.force()(friction.row) < 0 ? -1 : 1;
  Eigen::RowVectorXd gradient = friction.coefficient * D.row(i) - sign * D.row(friction.row);
  const std::vector<int>& parameters = dynamics_.variables().parameters;
  if (!parameters.empty()) {
    gradient.tail(static_cast<Eigen::Index>(parameters.size())) +=
        dynamics_.force()(i) * system_.DifferentiateFriction(parameters).row(i);
  }
  return gradient;
}

}  // namespace contact_flow
