// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/guards.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace contact_flow {

Guards::Guards(const MechanicalSystem& system) : system_(system), n_(system.num_constraints()) {
  const bool room = 3 * n_ <= ConstraintSet::kMaxConstraints;
  for (int i = 0; i < n_; ++i) {
    const bool slips = system.HasFriction() && (room || system.friction()[i].dimension > 0);
    const auto k = static_cast<int>(contacts_.size());
    first_.push_back(slips ? n_ + 2 * k : -1);
    if (slips) contacts_.push_back(i);
  }
  const auto with_friction = static_cast<int>(contacts_.size());
  size_ = n_ + 2 * with_friction;
  if (size_ <= ConstraintSet::kMaxConstraints) return;
  throw std::invalid_argument("of " + std::to_string(n_) + " constraints " +
                              std::to_string(with_friction) +
                              " have friction: constraints and twice those with friction may be " +
                              std::to_string(ConstraintSet::kMaxConstraints) + " at most");
}

int Guards::SharedGuard(const ConstraintSet& shared) const {
  for (int i : shared) {
    if (OfFriction(i) >= 0) return OfFriction(i) + 1;
  }
  throw std::domain_error("contacts " + shared.ToString(system_.description().constraints) +
                          " without friction share forces, which takes a system of at most " +
                          std::to_string(ConstraintSet::kMaxConstraints / 3) + " constraints");
}

ConstraintSet Guards::OfForces(const ContactMode& mode, const ConstraintSet& shared) const {
  const ConstraintSet rigid = mode - system_.compliant();
  if (!system_.HasFriction()) return rigid;
  ConstraintSet guards;
  if (!shared.Empty()) guards.Insert(SharedGuard(shared));
  for (int i : rigid - shared) {
    const Friction& friction = system_.friction()[i];
    if (mode.LetterOf(i) != Letter::kStick || std::isinf(friction.coefficient)) {
      guards.Insert(i);
      continue;
    }
    guards.Insert(OfFriction(i));
    if (friction.dimension == 1) guards.Insert(OfFriction(i) + 1);
  }
  return guards;
}

ConstraintSet Guards::OfSlips(const ContactMode& mode) const {
  ConstraintSet guards;
  for (int i : mode.SlippingInPlane()) guards.Insert(OfFriction(i));
  return guards;
}

GuardKind Guards::KindOf(int guard, const ContactMode& mode, const ConstraintSet& shared) const {
  if (IsNormal(guard)) {
    return (mode - system_.compliant()).Contains(guard) ? GuardKind::kForce : GuardKind::kGap;
  }
  return OfForces(mode, shared).Contains(guard) ? GuardKind::kCone : GuardKind::kSlip;
}

GuardJet Guards::At(int guard, ContactDynamics* dynamics, const VectorRef& x,
                    const ContactMode& mode) const {
  Vector rates;
  if (!IsNormal(guard)) rates = dynamics->ForceRate(x, mode);  // … and which contacts share forces
  switch (KindOf(guard, mode, dynamics->shared())) {
    case GuardKind::kForce: {
      const double rate = dynamics->ForceRate(x, mode, guard);
      return {dynamics->force()(guard), rate};
    }
    case GuardKind::kCone:
      return {OfForce(guard, *dynamics), RateOfForce(guard, *dynamics, rates)};
    default: {
      const auto v = x.tail(system_.dof());
      ConstraintTerms terms;
      system_.ConstraintsOf(ConstraintSet{ConstraintOf(guard)}, x.head(system_.num_positions()), v,
                            &terms);
      return OfMotion(guard, mode, terms, v, dynamics->acceleration());
    }
  }
}

GuardJet Guards::OfMotion(int guard, const ContactMode& mode, const ConstraintTerms& at,
                          const VectorRef& v, const Vector& acceleration) const {
  if (IsNormal(guard)) {
    const double sign = GapSign(guard, mode);
    return {sign * at.gap(guard), sign * at.jacobian.row(guard).dot(v)};
  }
  const Friction& friction = system_.friction()[ConstraintOf(guard)];
  Eigen::Vector2d slip, rate;
  for (int k = 0; k < friction.dimension; ++k) {
    const auto row = at.jacobian.row(friction.row + k);
    slip(k) = row.dot(v);
    rate(k) = row.dot(acceleration) + at.bias(friction.row + k);
  }
  return OfSlip(guard, mode, slip.head(friction.dimension), rate.head(friction.dimension));
}

GuardJet Guards::OfSlip(int guard, const ContactMode& mode, const GapSample& at) const {
  const Friction& friction = system_.friction()[ConstraintOf(guard)];
  return OfSlip(guard, mode, at.rate.segment(friction.row, friction.dimension),
                at.acceleration.segment(friction.row, friction.dimension));
}

/// By T v and its rate.
GuardJet Guards::OfSlip(int guard, const ContactMode& mode, const VectorRef& slip,
                        const VectorRef& rate) const {
  if (slip.size() == 2) return {slip.norm(), slip.dot(rate) / slip.norm()};
  const double sign = SlipSign(mode.LetterOf(ConstraintOf(guard)));
  return {sign * slip(0), sign * rate(0)};
}

double Guards::OfForce(int guard, const ContactDynamics& at) const {
  const Vector& force = at.force();
  if (guard < n_) return force(guard);
  const int i = ConstraintOf(guard);
  if (at.shared().Contains(i)) return at.shared_margin();
  const Friction& friction = system_.friction()[i];
  const double cone = friction.coefficient * force(i);
  if (friction.dimension == 2) return cone - force.segment<2>(friction.row).norm();
  const bool forward = (guard - n_) % 2 == 0;
  return forward ? cone + force(friction.row) : cone - force(friction.row);
}

Eigen::RowVectorXd Guards::GradientOfForce(int guard, const ContactDynamics& at,
                                           const MatrixRef& by) const {
  if (guard < n_) return by.row(guard);
  const int i = ConstraintOf(guard);
  if (at.shared().Contains(i)) return at.shared_gradient().transpose() * by;
  const Friction& friction = system_.friction()[i];
  const auto tangential = by.middleRows(friction.row, friction.dimension);
  const Eigen::RowVectorXd cone = friction.coefficient * by.row(i);
  if (friction.dimension == 1) {
    return (guard - n_) % 2 == 0 ? Eigen::RowVectorXd(cone + tangential)
                                 : Eigen::RowVectorXd(cone - tangential);
  }
  const Eigen::Vector2d slip = at.force().segment<2>(friction.row);
  const double norm = slip.norm();
  if (!(norm > 0)) return cone;
  return cone - (slip.transpose() / norm) * tangential;
}

}  // namespace contact_flow
