// SPDX-License-Identifier: BSD-3-Clause
#include "neglected_coupling.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// What errors of single steps, each within the tolerances, may grow to.
constexpr double kAccumulated = 1e3;
/// Normalized couplings below this are rounding.
constexpr double kCouplingRounding = 1e-13;

}  // namespace

NeglectedCoupling::NeglectedCoupling(ContactDynamics* dynamics, const Transition& transition,
                                     const TouchingFrame& frame, ClusterGeometry* geometry)
    : dynamics_(*dynamics),
      system_(dynamics->system()),
      transition_(transition),
      frame_(frame),
      geometry_(*geometry),
      q_(transition.x_minus.head(system_.num_positions())) {
  const int d = system_.dof();
  const Vector v = transition.x_minus.tail(d);
  const ConstraintSet rigid = transition.mode_before - system_.compliant();
  const ImpactResult impact = frame.Impact(v, frame.touching);
  impulse_.setZero(frame.touching.Size());
  for (int i : frame.touching) {
    const int row = frame.Row(i);
    impulse_(row) = std::abs(impact.impulse(i));
    if (!transition.activated.Contains(i)) continue;
    const double alone =
        (1 + frame.Restitution(i)) * std::abs(frame.Rate(i, v)) / frame.G(row, row);
    impulse_(row) = std::max(impulse_(row), alone);
  }
  // What rests may be pushed by each of them in turn.
  for (int i : frame.touching - transition.activated) {
    const int row = frame.Row(i);
    double pushed = 0;
    for (int j : transition.activated) {
      pushed += std::abs(frame.G(row, frame.Row(j))) * impulse_(frame.Row(j)) / frame.G(row, row);
    }
    impulse_(row) = std::max(impulse_(row), pushed);
  }
  const Matrix reset =
      geometry_.Reset(v, impact, impact.hit, impact.hit & rigid).matrix().middleRows(d, d);
  // δx. Coordinates that are not numbers of their own (quaternions) share the largest.
  const double absolute = kAccumulated * transition.absolute_tolerance;
  const double relative = relative_ = kAccumulated * transition.relative_tolerance;
  Vector error(2 * d);
  const double far = q_.size() > 0 ? q_.cwiseAbs().maxCoeff() : 0;
  for (int k = 0; k < d; ++k) {
    error(k) = absolute + relative * (q_.size() == d ? std::abs(q_(k)) : far);
    error(d + k) = absolute + relative * std::abs(v(k));
  }
  // By q of the simultaneous impact; by v of each impact alone, as far as no other takes it back.
  outcome_limit_ = reset.leftCols(d).cwiseAbs() * error.head(d) + error.tail(d);
  for (int i : frame.touching) {
    const int row = frame.Row(i);
    const double change = frame.A.row(row).cwiseAbs().dot(error.tail(d));
    outcome_limit_ +=
        frame.Y.col(row).cwiseAbs() * ((1 + frame.Restitution(i)) * change / frame.G(row, row) +
                                       10 * kCouplingRounding * impulse_(row));
  }
  outcome_limit_ += 10 * kCouplingRounding * v.cwiseAbs();
  ScaleDerivatives(reset);
  // Speeds that count as rest: those that the error of the state leaves open.
  double fastest = 0;
  for (int i : frame.touching) fastest = std::max(fastest, std::abs(frame.Rate(i, v)));
  rest_ = (relative * fastest) * Vector::Ones(frame.touching.Size()) +
          100 * kCouplingRounding * frame.A.cwiseAbs() * (v.cwiseAbs() + impact.v_plus.cwiseAbs());
  for (int i : transition.activated) {
    for (int j : frame.touching.Without(i)) {
      if (!Orthogonal(i, j)) continue;
      rest_(frame.Row(j)) +=
          2 * std::abs(frame.G(frame.Row(i), frame.Row(j))) * impulse_(frame.Row(i));
    }
  }
}

void NeglectedCoupling::ScaleDerivatives(const MatrixRef& reset) {
  const int d = system_.dof();
  const Matrix& mass = geometry_.inertia()->mass();
  scale_ = mass.diagonal().cwiseSqrt().cwiseInverse();
  for (int j : Driven(mass)) scale_(j) = 1;
  const Vector acceleration = dynamics_.Field(transition_.x_minus, transition_.mode_before).tail(d);
  hurry_ = KineticSpeed(mass, acceleration);
  derivative_limit_ =
      relative_ * std::max(1.0, Scaled(reset.middleCols(d, d)).cwiseAbs().maxCoeff());
}

Matrix NeglectedCoupling::Scaled(const MatrixRef& D) const {
  return scale_.cwiseInverse().asDiagonal() * D * scale_.asDiagonal();
}

/// What the impact of `hit` changes at `other`, given back by an impulse there.
Vector NeglectedCoupling::Response(int hit, int other) const {
  const int a = frame_.Row(hit), b = frame_.Row(other);
  const double back = transition_.activated.Contains(other) ? 1 + frame_.Restitution(other) : 1;
  return frame_.Y.col(b).cwiseAbs() *
         (back * std::abs(frame_.G(a, b)) * impulse_(a) / frame_.G(b, b));
}

Vector NeglectedCoupling::Jump(int i, int j) const { return Response(i, j) + Response(j, i); }

double NeglectedCoupling::ResponseOfDerivative(int hit, int other, const Vector& scale) const {
  const int a = frame_.Row(hit), b = frame_.Row(other);
  const auto push = [&](int i) {  // of the impulse at i, by v⁻
    const int row = frame_.Row(i);
    return (1 + frame_.Restitution(i)) *
           frame_.A.row(row).cwiseAbs().cwiseProduct(scale.transpose()).maxCoeff() /
           frame_.G(row, row);
  };
  double impulse = 0;  // at `hit`, by v⁻
  if (transition_.activated.Contains(hit)) {
    impulse = push(hit);
  } else {
    for (int i : transition_.activated) {
      impulse += std::abs(frame_.G(a, frame_.Row(i))) / frame_.G(a, a) * push(i);
    }
  }
  const double back = transition_.activated.Contains(other) ? 1 + frame_.Restitution(other) : 1;
  const double response = frame_.Y.col(b).cwiseAbs().cwiseQuotient(scale).maxCoeff();
  return response * back * std::abs(frame_.G(a, b)) / frame_.G(b, b) * impulse;
}

double NeglectedCoupling::JumpOfDerivative(int i, int j) const {
  const Vector one = Vector::Ones(system_.dof());
  return ResponseOfDerivative(i, j, one) + ResponseOfDerivative(j, i, one);
}

bool NeglectedCoupling::Orthogonal(int i, int j) const {
  const int a = frame_.Row(i), b = frame_.Row(j);
  if (std::abs(frame_.G(a, b)) <= kCouplingRounding * std::sqrt(frame_.G(a, a) * frame_.G(b, b))) {
    return true;
  }
  return (Jump(i, j).array() <= outcome_limit_.array()).all() &&
         ResponseOfDerivative(i, j, scale_) + ResponseOfDerivative(j, i, scale_) <=
             derivative_limit_;
}

ImpactLift NeglectedCoupling::LiftBy(int j, ConstraintSet held, const Vector& v) const {
  return ImpactLift(dynamics_, frame_, transition_, scale_, &geometry_,
                    {j, held, v, hurry_, relative_});
}

}  // namespace contact_flow
