// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/impact_reset.h"

#include <stdexcept>
#include <utility>

namespace contact_flow {

bool ImpactReset::Terms::Allowed(const MechanicalSystem& system, const InverseInertia& inertia,
                                 const Variables& variables) {
  return inertia.mass_factor().sparse() && inertia.mass_factor().regular() &&
         variables.parameters.empty() && system.num_bilateral() == 0;
}

ImpactReset::ImpactReset(std::shared_ptr<const Terms> terms, ContactMode hit,
                         ContactMode persisting)
    : terms_(std::move(terms)) {
  const InverseInertia& inertia = *terms_->inertia;
  const int d = terms_->system.dof();
  for (int i : hit) rows_.push_back(i);
  const auto k = static_cast<Eigen::Index>(rows_.size());
  restitution_.setZero(k);
  reach_.resize(d, k);
  for (Eigen::Index row = 0; row < k; ++row) {
    const int i = rows_[static_cast<std::size_t>(row)];
    if (!persisting.Contains(i)) restitution_(row) = terms_->system.restitution()(i);
    reach_.col(row) = inertia.terms().jacobian.row(i);
    inertia.mass_factor().SolveL(reach_.col(row));
  }
  factor_.compute(inertia.Delassus(hit));
  if (factor_.info() != Eigen::Success) {
    throw std::domain_error("an impact has no derivative: its constraints are dependent");
  }
}

Matrix ImpactReset::Velocities(const MatrixRef& w) const {
  const InverseInertia& inertia = *terms_->inertia;
  const int d = terms_->system.dof();
  const auto w_q = w.topRows(d), w_v = w.bottomRows(d);
  Matrix x = inertia.mass() * w_v - terms_->momentum_q * w_q;
  for (Eigen::Index c = 0; c < x.cols(); ++c) inertia.mass_factor().SolveL(x.col(c));
  Matrix push = -reach_.transpose() * x;  // A x₀ = Wᵀ L⁻¹(…)
  for (Eigen::Index row = 0; row < push.rows(); ++row) {
    const int i = rows_[static_cast<std::size_t>(row)];
    push.row(row) -= terms_->after_q.row(i) * w_q;
    const double restitution = restitution_(row);
    if (restitution == 0) continue;
    push.row(row) -= restitution * (terms_->before_q.row(i) * w_q +
                                    inertia.terms().jacobian.row(i) * w_v);
  }
  factor_.solveInPlace(push);
  x += reach_ * push;
  inertia.mass_factor().SolveLTransposed(&x);
  if (!x.allFinite()) {
    throw std::domain_error("an impact has no derivative: its constraints are dependent");
  }
  return x;
}

Vector ImpactReset::operator*(const Vector& w) const {
  if (terms_ == nullptr) return matrix_ * w;
  const int d = terms_->system.dof();
  Vector result = w;
  result.segment(d, d) = Velocities(w.head(2 * d));
  return result;
}

const Matrix& ImpactReset::matrix() const {
  if (matrix_.size() > 0) return matrix_;
  const int d = terms_->system.dof();
  matrix_.setIdentity(terms_->tangents, terms_->tangents);
  matrix_.block(d, 0, d, 2 * d) = Velocities(Matrix::Identity(2 * d, 2 * d));
  return matrix_;
}

}  // namespace contact_flow
