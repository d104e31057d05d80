// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/linear_inputs.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace contact_flow {
namespace {

/// `name`, with strokes where that is taken.
std::string Free(std::string name, const std::vector<std::string>& taken) {
  while (std::find(taken.begin(), taken.end(), name) != taken.end()) name += "'";
  return name;
}

/// A column of zeros more.
void Widen(Matrix* matrix) {
  matrix->conservativeResize(Eigen::NoChange, matrix->cols() + 1);
  matrix->rightCols<1>().setZero();
}

/// A row of zeros more.
void Lengthen(Matrix* matrix) {
  matrix->conservativeResize(matrix->rows() + 1, Eigen::NoChange);
  matrix->bottomRows<1>().setZero();
}

}  // namespace

LinearInputs::LinearInputs(std::shared_ptr<const MechanicalSystem> base)
    : base_(std::move(base)),
      limits_(dynamic_cast<const EffortLimits*>(base_.get())),
      knots_(dynamic_cast<const SplineKnots*>(base_.get())),
      narrow_(dynamic_cast<const NarrowSurfaces*>(base_.get())),
      nq_(base_->num_positions()),
      d_(base_->dof()),
      m_(base_->num_inputs()) {
  description_ = base_->description();
  const std::string clock = Free("clock of inputs", description_.coordinates);
  description_.coordinates.push_back(clock);
  description_.units.push_back("s");
  description_.velocities.push_back(clock);
  for (int j = 0; j < m_; ++j) {
    const std::string& name = description_.inputs[static_cast<std::size_t>(j)];
    description_.inputs.push_back(Free("d/dt " + name, description_.inputs));
  }
  description_.inputs.push_back(Free("begin of inputs", description_.inputs));
  space_ = base_->space();
  space_.Append(ConfigurationSpace::Factor::kLine);
  restitution_ = base_->restitution();
  compliant_ = base_->compliant();
  contact_effort_ = base_->HasContactEffort();
  friction_ = base_->friction();
  num_tangential_ = base_->num_tangential();
  nominal_ = base_->nominal();
  // A system may have no nominal run.
  if (nominal_.x.size() == nq_ + d_) nominal_.x = State(base_->nominal().x, 0);
  nominal_.u = Vector::Zero(2 * m_ + 1);
  if (base_->nominal().u.size() == m_) nominal_.u.head(m_) = base_->nominal().u;
}

Vector LinearInputs::State(const VectorRef& x, double clock) const {
  Vector led(nq_ + d_ + 2);
  led << x.head(nq_), clock, x.tail(d_), 1;
  return led;
}

Vector LinearInputs::BaseState(const VectorRef& x) const {
  Vector base(nq_ + d_);
  base << x.head(nq_), x.segment(nq_ + 1, d_);
  return base;
}

Vector LinearInputs::Acting(const VectorRef& q, const VectorRef& held) const {
  return held.head(m_) + (q(nq_) - held(2 * m_)) * held.segment(m_, m_);
}

Vector LinearInputs::Held(double t, double h, const VectorRef& u0, const VectorRef& u1) {
  Vector held(2 * u0.size() + 1);
  held << u0, (u1 - u0) / h, t;
  return held;
}

void LinearInputs::Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                            const ContactMode& mode, Matrix* mass, Vector* force) const {
  Matrix inner;
  base_->Dynamics(q.head(nq_), v.head(d_), Acting(q, u), mode, mass == nullptr ? nullptr : &inner,
                  force);
  force->conservativeResize(d_ + 1);
  (*force)(d_) = 0;
  if (mass == nullptr) return;
  mass->setZero(d_ + 1, d_ + 1);
  mass->topLeftCorner(d_, d_) = inner;
  (*mass)(d_, d_) = 1;
}

void LinearInputs::Constraints(const VectorRef& q, const VectorRef& v,
                               ConstraintTerms* terms) const {
  base_->Constraints(q.head(nq_), v.head(d_), terms);
  Widen(&terms->jacobian);
}

void LinearInputs::ConstraintsOf(const ConstraintSet& asked, const VectorRef& q, const VectorRef& v,
                                 ConstraintTerms* terms) const {
  base_->ConstraintsOf(asked, q.head(nq_), v.head(d_), terms);
  Widen(&terms->jacobian);
}

void LinearInputs::DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, ResidualJacobian* jacobian) const {
  base_->DifferentiateDynamics(q.head(nq_), v.head(d_), Acting(q, u), mode, acceleration.head(d_),
                               force, jacobian);
  AddClock(q, u, jacobian);
}

void LinearInputs::DifferentiateDynamicsOfMode(const VectorRef& q, const VectorRef& v,
                                               const VectorRef& u, const ContactMode& mode,
                                               const VectorRef& acceleration,
                                               const VectorRef& force,
                                               ResidualJacobian* jacobian) const {
  base_->DifferentiateDynamicsOfMode(q.head(nq_), v.head(d_), Acting(q, u), mode,
                                     acceleration.head(d_), force, jacobian);
  AddClock(q, u, jacobian);
}

/// The residual follows τ as it follows u, at the rate b.
void LinearInputs::AddClock(const VectorRef& q, const VectorRef& u,
                            ResidualJacobian* jacobian) const {
  const Matrix by_input = jacobian->momentum_u;
  const Vector by_clock = by_input * u.segment(m_, m_);
  for (Matrix* part : {&jacobian->momentum_q, &jacobian->momentum_v}) {
    Widen(part);
    Lengthen(part);
  }
  jacobian->momentum_q.col(d_).head(d_) = by_clock;
  Widen(&jacobian->constraint_q);
  Widen(&jacobian->constraint_v);
  jacobian->momentum_u.setZero(d_ + 1, 2 * m_ + 1);
  jacobian->momentum_u.topLeftCorner(d_, m_) = by_input;
  jacobian->momentum_u.block(0, m_, d_, m_) = (q(nq_) - u(2 * m_)) * by_input;
  jacobian->momentum_u.col(2 * m_).head(d_) = -by_clock;
}

void LinearInputs::DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       ResidualJacobian* jacobian) const {
  base_->DifferentiateImpact(q.head(nq_), jump.head(d_), impulse, s.head(d_), jacobian);
  Widen(&jacobian->momentum_q);
  Lengthen(&jacobian->momentum_q);
  Widen(&jacobian->constraint_q);
}

void LinearInputs::DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v,
                                                     const VectorRef& u, const ContactMode& mode,
                                                     const VectorRef& acceleration,
                                                     const VectorRef& force,
                                                     const std::vector<int>& parameters,
                                                     ParameterJacobian* jacobian) const {
  base_->DifferentiateDynamicsByParameters(q.head(nq_), v.head(d_), Acting(q, u), mode,
                                           acceleration.head(d_), force, parameters, jacobian);
  Lengthen(&jacobian->momentum);
}

void LinearInputs::DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                                   const VectorRef& impulse, const VectorRef& s,
                                                   const std::vector<int>& parameters,
                                                   ParameterJacobian* jacobian) const {
  base_->DifferentiateImpactByParameters(q.head(nq_), jump.head(d_), impulse, s.head(d_),
                                         parameters, jacobian);
  Lengthen(&jacobian->momentum);
}

const std::vector<std::string>& LinearInputs::limited_efforts() const {
  static const std::vector<std::string> none;
  return limits_ == nullptr ? none : limits_->limited_efforts();
}

void LinearInputs::EffortShares(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                const ContactMode& mode, Vector* share) const {
  if (limits_ == nullptr) {
    share->resize(0);
    return;
  }
  limits_->EffortShares(q.head(nq_), v.head(d_), Acting(q, u), mode, share);
}

double LinearInputs::TimeToKnot(const VectorRef& q, const VectorRef& v) const {
  if (knots_ == nullptr) return std::numeric_limits<double>::infinity();
  return knots_->TimeToKnot(q.head(nq_), v.head(d_));
}

const std::vector<std::vector<double>>& LinearInputs::knots_of_places() const {
  static const std::vector<std::vector<double>> none;
  return knots_ == nullptr ? none : knots_->knots_of_places();
}

void LinearInputs::Places(const VectorRef& q, const ContactMode& mode, Vector* place) const {
  place->resize(0);
  if (knots_ != nullptr) knots_->Places(q.head(nq_), mode, place);
}

bool LinearInputs::HasNarrowSurfaces() const {
  return narrow_ != nullptr && narrow_->HasNarrowSurfaces();
}

void LinearInputs::Passages(const VectorRef& q, const VectorRef& v,
                            std::vector<SurfacePassage>* passages) const {
  passages->clear();
  if (narrow_ != nullptr) narrow_->Passages(q.head(nq_), v.head(d_), passages);
}

}  // namespace contact_flow
