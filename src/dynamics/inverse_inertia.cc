// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/inverse_inertia.h"

#include <limits>
#include <utility>
#include <vector>

#include "contact_flow/model/row_layout.h"
#include "solve_columns.h"

namespace contact_flow {
namespace {

Matrix Undefined(Eigen::Index rows, Eigen::Index cols) {
  return Matrix::Constant(rows, cols, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace

InverseInertia::InverseInertia(const MechanicalSystem& system, const VectorRef& q,
                               const VectorRef& v, const VectorRef& u, const ContactMode& mode)
    : n_(system.num_constraints()) {
  system.Dynamics(q, v, u, mode, &mass_, &applied_);
  system.Constraints(q, v, &terms_);
  mass_factor_.Compute(mass_);
  regular_ = mass_factor_.regular();
  if (system.num_bilateral() == 0) return;
  const auto B = RowLayout(system).Bilateral(terms_.jacobian);
  reach_ = mass_factor_.Solved(B.transpose());
  bilateral_factor_.compute(B * reach_);
  regular_ = regular_ && bilateral_factor_.info() == Eigen::Success;
}

InverseInertia::InverseInertia(const MechanicalSystem& system, const VectorRef& q,
                               const VectorRef& v)
    : InverseInertia(system, q, v, Vector::Zero(system.num_inputs()), ContactMode()) {}

Matrix InverseInertia::Rows(const ConstraintSet& members) const {
  Matrix rows(members.Size(), terms_.jacobian.cols());
  int row = 0;
  for (int i : members) rows.row(row++) = terms_.jacobian.row(i);
  return rows;
}

Matrix InverseInertia::operator*(const MatrixRef& R) const {
  if (!regular_) return Undefined(R.rows(), R.cols());
  Matrix result = R;
  mass_factor_.Solve(&result);
  if (reach_.cols() > 0) result -= reach_ * bilateral_factor_.solve(reach_.transpose() * R);
  return result;
}

Matrix InverseInertia::Delassus(const ConstraintSet& members) const {
  if (!regular_ || !mass_factor_.sparse() || reach_.cols() > 0) {
    const Matrix A = Rows(members);
    return A * (*this * A.transpose());
  }
  const Matrix& all = Sparse().delassus;
  std::vector<int> rows;
  for (int i : members) rows.push_back(i);
  const auto k = static_cast<Eigen::Index>(rows.size());
  Matrix G(k, k);
  for (Eigen::Index j = 0; j < k; ++j) {
    for (Eigen::Index i = 0; i < k; ++i) G(i, j) = all(rows[i], rows[j]);
  }
  return G;
}

const InverseInertia::SparseTerms& InverseInertia::Sparse() const {
  if (sparse_) return *sparse_;
  Matrix reach = terms_.jacobian.topRows(n_).transpose();
  for (Eigen::Index i = 0; i < n_; ++i) mass_factor_.SolveL(reach.col(i));
  auto terms = std::make_shared<SparseTerms>();
  terms->delassus.resize(n_, n_);
  MultiplySparseColumns(reach, &terms->delassus);
  terms->reach = SparseRows(reach.transpose());
  terms->jacobian = SparseRows(terms_.jacobian);
  sparse_ = std::move(terms);
  return *sparse_;
}

Matrix InverseInertia::BilateralForce(const MatrixRef& R) const {
  if (reach_.cols() == 0) return Matrix(0, R.cols());
  if (!regular_) return Undefined(reach_.cols(), R.cols());
  return -bilateral_factor_.solve(reach_.transpose() * R);
}

Vector InverseInertia::FreeAcceleration() const {
  if (!regular_) return Undefined(applied_.size(), 1);
  Vector acceleration = *this * applied_;
  if (reach_.cols() > 0) {
    acceleration -= reach_ * bilateral_factor_.solve(terms_.bias.segment(n_, reach_.cols()));
  }
  return acceleration;
}

Vector InverseInertia::Correction(const VectorRef& r) const {
  if (!regular_) return Undefined(reach_.rows(), 1);
  return -reach_ * bilateral_factor_.solve(r);
}

}  // namespace contact_flow
