// SPDX-License-Identifier: BSD-3-Clause
#include "cluster_geometry.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

/// A force below this part of the largest one may vanish at the instant, as in SelectMode.
constexpr double kNearZero = 1e-4;

}  // namespace

ClusterGeometry::ClusterGeometry(const MechanicalSystem& system, const Vector& q, const Vector& v)
    : system_(system), q_(q), inertia_(std::make_shared<const InverseInertia>(system, q, v)) {}

const ClusterGeometry::Unit& ClusterGeometry::UnitOf(int i) {
  const auto known = units_.find(i);
  if (known != units_.end()) return known->second;
  Vector impulse = Vector::Zero(system_.num_rows());
  impulse(i) = 1;
  const Vector jump = *inertia_ * inertia_->terms().jacobian.row(i).transpose();
  ResidualJacobian residual;
  system_.DifferentiateImpact(q_, jump, impulse, jump, &residual);
  return units_[i] = {residual.momentum_q, residual.constraint_q};
}

void ClusterGeometry::DifferentiateImpact(const ImpactResult& impact, const Matrix& before_q,
                                          Matrix* momentum_q, Matrix* after_q) {
  const int d = system_.dof();
  momentum_q->setZero(d, d);
  *after_q = before_q;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const double impulse = impact.impulse(i);
    if (impulse == 0) continue;
    const Unit& unit = UnitOf(i);
    *momentum_q += impulse * unit.momentum_q;
    *after_q += impulse * unit.rates_q;
  }
}

bool ClusterGeometry::Accelerate(const Vector& u, const Vector& v, ContactMode mode,
                                 const MatrixRef& rates_q, Vector* acceleration) const {
  const ContactMode contacts = mode - system_.compliant();
  const MassFactor& mass = inertia_->mass_factor();
  Matrix unused;
  Vector applied;
  system_.Dynamics(q_, v, u, mode, nullptr, &applied);
  Vector free = applied;
  mass.SolveL(free);
  mass.SolveLTransposed(free);
  const auto k = static_cast<Eigen::Index>(contacts.Size());
  const Matrix G = inertia_->Delassus(contacts), A = inertia_->Rows(contacts);
  const Eigen::LLT<Matrix> factor(G);
  if (factor.info() != Eigen::Success) return false;
  Vector force(k);
  Eigen::Index row = 0;
  Vector terms(k);
  for (int i : contacts) {
    const double bias = rates_q.row(i).dot(v);  // (d/dt Da_i) v
    force(row) = -A.row(row).dot(free) - bias;
    terms(row) = A.row(row).cwiseAbs().dot(free.cwiseAbs()) + std::abs(bias);
    ++row;
  }
  factor.solveInPlace(force);
  if (!(force.minCoeff() > 0)) return false;
  const double largest = applied.cwiseAbs().maxCoeff();
  double scale = force.maxCoeff();
  for (Eigen::Index i = 0; i < k; ++i) {
    const double pivot = factor.matrixLLT()(i, i);
    if (!(pivot * pivot >= kDependentRow * G(i, i))) return false;
    const double all = terms(i) + G.col(i).cwiseAbs().dot(force);
    scale = std::max(scale, all / G(i, i) + largest / A.row(i).cwiseAbs().maxCoeff());
  }
  if (!(force.minCoeff() > kNearZero * (1 + scale))) return false;
  *acceleration = A.transpose() * force;
  mass.SolveL(*acceleration);
  mass.SolveLTransposed(*acceleration);
  *acceleration += free;
  return true;
}

}  // namespace contact_flow
