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

ImpactReset::ImpactReset(std::shared_ptr<const Terms> terms, const ConstraintSet& hit,
                         const ConstraintSet& persisting)
    : terms_(std::move(terms)) {
  for (int i : hit) rows_.push_back(i);
  restitution_.setZero(static_cast<Eigen::Index>(rows_.size()));
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    const int i = rows_[row];
    if (!persisting.Contains(i)) restitution_(row) = terms_->system.restitution()(i);
  }
  factor_ = std::make_shared<const Eigen::LLT<Matrix>>(terms_->inertia->Delassus(hit));
  if (factor_->info() != Eigen::Success) {
    throw std::domain_error("an impact has no derivative: its constraints are dependent");
  }
}

Vector ImpactReset::Velocity(const VectorRef& w_q, const VectorRef& w_v) const {
  const InverseInertia& inertia = *terms_->inertia;
  const SparseRows &A = inertia.sparse_jacobian(), &reach = inertia.sparse_reach();
  Vector x = terms_->momentum_q * w_q;  // the change by it, Lᵀ (w_v − x)
  inertia.mass_factor().SolveL(x);
  Vector push(restitution_.size());
  for (Eigen::Index row = 0; row < push.size(); ++row) {
    const int i = rows_[static_cast<std::size_t>(row)];
    const double rate = A.Dot(i, w_v), restitution = restitution_(row);
    push(row) = reach.Dot(i, x) - rate - terms_->after_q.Dot(i, w_q);
    if (restitution != 0) push(row) -= restitution * (terms_->before_q.Dot(i, w_q) + rate);
  }
  factor_->solveInPlace(push);
  for (Eigen::Index row = 0; row < push.size(); ++row) {
    reach.AddRow(rows_[static_cast<std::size_t>(row)], -push(row), x);
  }
  inertia.mass_factor().SolveLTransposed(x);
  x = w_v - x;
  if (!x.allFinite()) {
    throw std::domain_error("an impact has no derivative: its constraints are dependent");
  }
  return x;
}

Vector ImpactReset::operator*(const Vector& w) const {
  if (terms_ == nullptr) return matrix_ * w;
  const int d = terms_->system.dof();
  Vector result = w;
  result.segment(d, d) = Velocity(w.head(d), w.segment(d, d));
  return result;
}

Matrix ImpactReset::operator*(const Matrix& W) const {
  if (terms_ == nullptr) return matrix_ * W;
  const int d = terms_->system.dof();
  Matrix result = W;
  for (Eigen::Index c = 0; c < W.cols(); ++c) {
    result.col(c).segment(d, d) = Velocity(W.col(c).head(d), W.col(c).segment(d, d));
  }
  return result;
}

const Matrix& ImpactReset::matrix() const {
  if (matrix_.size() > 0) return matrix_;
  const Matrix all = Matrix::Identity(terms_->tangents, terms_->tangents);
  return matrix_ = *this * all;
}

Matrix ImpactReset::ByConfiguration(int d) const {
  if (terms_ == nullptr) return matrix_.block(d, 0, d, d);
  const Vector still = Vector::Zero(d);
  Matrix result(d, d);
  for (int c = 0; c < d; ++c) result.col(c) = Velocity(Vector::Unit(d, c), still);
  return result;
}

}  // namespace contact_flow
