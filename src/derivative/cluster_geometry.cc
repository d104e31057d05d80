// SPDX-License-Identifier: BSD-3-Clause
#include "cluster_geometry.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

/// A force below this part of the largest one may vanish at the instant, as in SelectMode.
constexpr double kNearZero = 1e-4;

}  // namespace

ClusterGeometry::ClusterGeometry(const ContactDynamics& dynamics, const Transition& transition)
    : system_(dynamics.system()),
      variables_(dynamics.variables()),
      q_(transition.x_minus.head(system_.num_positions())),
      v_minus_(transition.x_minus.tail(system_.dof())),
      contacts_((transition.mode_before - system_.compliant()) | transition.activated |
                transition.touching),
      inertia_(std::make_shared<const InverseInertia>(system_, q_, v_minus_)),
      jacobian_(std::make_shared<const SparseRows>(inertia_->terms().jacobian)),
      mobility_(
          inertia_->Delassus(ConstraintSet::All(system_.num_constraints())).diagonal().cwiseSqrt()),
      products_(ImpactReset::Terms::Allowed(system_, *inertia_, variables_)) {}

const SparseRows& ClusterGeometry::RatesAtFirst() {
  if (rates_minus_.rows() == 0) rates_minus_ = Differentiate(v_minus_);
  return rates_minus_;
}

SparseRows ClusterGeometry::RatesBy(const Vector& v) {
  return v == v_minus_ ? RatesAtFirst() : Differentiate(v);
}

SparseRows ClusterGeometry::Differentiate(const Vector& v) const {
  ResidualJacobian residual;
  system_.DifferentiateImpact(q_, Vector::Zero(system_.dof()), Vector::Zero(system_.num_rows()), v,
                              &residual);
  return SparseRows(residual.constraint_q);
}

const ClusterGeometry::Unit& ClusterGeometry::UnitOf(int i) {
  if (units_.empty()) MakeUnits();
  return units_.at(i);
}

/// At the same places, those of v⁻, too, so that their sums are quick.
void ClusterGeometry::MakeUnits() {
  RatesAtFirst();
  std::vector<SparseRows*> momenta, rates = {&rates_minus_};
  ResidualJacobian residual;
  for (int i : contacts_) {
    Vector impulse = Vector::Zero(system_.num_rows()), jump = Vector::Zero(system_.dof());
    impulse(i) = 1;
    inertia_->sparse_reach().AddRow(i, 1, jump);
    inertia_->mass_factor().SolveLTransposed(jump);
    system_.DifferentiateImpact(q_, jump, impulse, jump, &residual);
    Unit& unit = units_[i];
    unit = {SparseRows(residual.momentum_q), SparseRows(residual.constraint_q)};
    momenta.push_back(&unit.momentum_q);
    rates.push_back(&unit.rates_q);
  }
  SparseRows::Join(momenta);
  SparseRows::Join(rates);
}

SparseRows ClusterGeometry::TurnedBy(const ImpactResult& impact, const Vector& v) {
  if (!products_) return RatesBy(impact.v_plus - v);
  SparseRows turned(Matrix::Zero(system_.num_rows(), system_.dof()));
  for (int i : contacts_) {
    if (impact.impulse(i) != 0) turned.Add(impact.impulse(i), UnitOf(i).rates_q);
  }
  return turned;
}

std::shared_ptr<const ImpactReset::Terms> ClusterGeometry::Terms(const ImpactResult& impact,
                                                                 const SparseRows& before_q,
                                                                 int tangents) {
  SparseRows momentum_q, after_q = before_q;
  for (int i : contacts_) {
    const double impulse = impact.impulse(i);
    if (impulse == 0) continue;
    const Unit& unit = UnitOf(i);
    momentum_q.Add(impulse, unit.momentum_q);
    after_q.Add(impulse, unit.rates_q);
  }
  if (momentum_q.rows() == 0) momentum_q = SparseRows(Matrix::Zero(system_.dof(), system_.dof()));
  return std::make_shared<const ImpactReset::Terms>(ImpactReset::Terms{
      system_, inertia_, std::move(momentum_q), std::move(after_q), before_q, tangents});
}

ImpactReset ClusterGeometry::Reset(const Vector& v, const ImpactResult& impact, ConstraintSet hit,
                                   ConstraintSet persisting) {
  if (!products_) {
    return ImpactReset(
        ImpactJacobian(system_, *inertia_, q_, v, impact, hit, persisting, variables_));
  }
  const int tangents = 2 * system_.dof() + variables_.Size(system_);
  return ImpactReset(Terms(impact, RatesBy(v), tangents), hit, persisting);
}

bool ClusterGeometry::Accelerate(const Vector& u, const Vector& v, ContactMode mode,
                                 const SparseRows& rates_q, Vector* acceleration) const {
  const ConstraintSet contacts = mode - system_.compliant();
  const MassFactor& mass = inertia_->mass_factor();
  Vector applied;
  system_.Dynamics(q_, v, u, mode, nullptr, &applied);
  Vector free = applied;
  mass.SolveL(free);
  mass.SolveLTransposed(free);
  const auto k = static_cast<Eigen::Index>(contacts.Size());
  const Matrix G = inertia_->Delassus(contacts);
  const Eigen::LLT<Matrix> factor(G);
  if (factor.info() != Eigen::Success) return false;
  Vector force(k), terms(k);
  Eigen::Index row = 0;
  for (int i : contacts) {
    const double bias = rates_q.Dot(i, v);  // (d/dt Da_i) v
    force(row) = -jacobian_->Dot(i, free) - bias;
    terms(row++) = jacobian_->AbsDot(i, free) + std::abs(bias);
  }
  factor.solveInPlace(force);
  if (!(force.minCoeff() > 0)) return false;
  const double largest = applied.cwiseAbs().maxCoeff();
  double scale = force.maxCoeff();
  row = 0;
  for (int i : contacts) {
    const double gain = G(row, row), pivot = factor.matrixLLT()(row, row);
    if (!(pivot * pivot >= kDependentRow * gain)) return false;
    const double all = terms(row) + G.col(row).cwiseAbs().dot(force);
    scale = std::max(scale, all / gain + largest / jacobian_->Largest(i));
    ++row;
  }
  if (!(force.minCoeff() > kNearZero * (1 + scale))) return false;
  acceleration->setZero(system_.dof());
  row = 0;
  for (int i : contacts) inertia_->sparse_reach().AddRow(i, force(row++), *acceleration);
  mass.SolveLTransposed(*acceleration);
  *acceleration += free;
  return true;
}

}  // namespace contact_flow
