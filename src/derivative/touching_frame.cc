// SPDX-License-Identifier: BSD-3-Clause
#include "touching_frame.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

constexpr double kFrameRounding = 1e-13;

Matrix BlockOf(const Matrix& G, const std::vector<int>& rows, const std::vector<int>& columns) {
  Matrix block(rows.size(), columns.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j) block(i, j) = G(rows[i], columns[j]);
  }
  return block;
}

}  // namespace

TouchingFrame::TouchingFrame(const MechanicalSystem& system, const InverseInertia& inertia,
                             ConstraintSet touching_set, ImpactLaw impact_law)
    : touching(touching_set),
      law(impact_law),
      restitution_(system.restitution()),
      row_(static_cast<std::size_t>(system.num_constraints()), -1),
      num_constraints_(system.num_constraints()) {
  A = inertia.Rows(touching);
  Y = inertia * A.transpose();
  G = A * Y;
  reaction_ = Matrix::Zero(system.num_rows() - num_constraints_, A.rows());
  if (system.num_bilateral() > 0) {
    reaction_.topRows(system.num_bilateral()) = inertia.BilateralForce(A.transpose());
  }
  int row = 0;
  for (int i : touching) row_[static_cast<std::size_t>(i)] = row++;
}

std::vector<int> TouchingFrame::Rows(ConstraintSet subset) const {
  std::vector<int> rows;
  for (int i : subset) rows.push_back(Row(i));
  return rows;
}

ImpactResult TouchingFrame::Impact(const Vector& v, ConstraintSet subset) const {
  const std::vector<int> rows = Rows(subset);
  const int k = static_cast<int>(rows.size());
  const Matrix block = BlockOf(G, rows, rows);
  Vector b(k);
  int row = 0;
  for (int i : subset) b(row++) = (1 + restitution_(i)) * Rate(i, v);
  Vector p;
  if (law == ImpactLaw::kProjection) {
    const Eigen::LLT<Matrix> factor(block);
    if (factor.info() == Eigen::Success) p = -factor.solve(b);
  } else {
    const std::optional<ComplementaritySolution> solution = SolveComplementarity(block, b);
    if (solution) p = solution->z;
  }
  if (p.size() != k || !p.allFinite()) {
    throw std::domain_error("the touching constraints are dependent at an impact (Assumption 3)");
  }
  ImpactResult result;
  result.v_plus = v;
  result.impulse = Vector::Zero(num_constraints_ + reaction_.rows());
  const double zero = k > 0 ? kFrameRounding * b.cwiseAbs().maxCoeff() : 0;
  row = 0;
  for (int i : subset) {
    result.v_plus += Y.col(Row(i)) * p(row);
    result.impulse(i) = p(row);
    result.impulse.tail(reaction_.rows()) += reaction_.col(Row(i)) * p(row);
    if (std::abs(p(row)) * block(row, row) > zero) result.hit.Insert(i);
    ++row;
  }
  return result;
}

Vector TouchingFrame::HeldResponse(int i, ConstraintSet held) const {
  Vector response = Y.col(Row(i));
  if (held.Empty()) return response;
  const std::vector<int> rows = Rows(held);
  const Vector force = BlockOf(G, rows, rows).ldlt().solve(BlockOf(G, rows, {Row(i)}).col(0));
  for (std::size_t k = 0; k < rows.size(); ++k) response -= Y.col(rows[k]) * force(k);
  return response;
}

}  // namespace contact_flow
