// SPDX-License-Identifier: BSD-3-Clause
#include "retraction.h"

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"
#include "contact_flow/piecewise_linear/section.h"

namespace contact_flow {
namespace {

constexpr int kMaxRetractions = 20;
constexpr double kRetracted = 1e-15;  // [m]

Matrix SelectedRows(const Matrix& all, const std::vector<int>& rows) {
  Matrix some(static_cast<Eigen::Index>(rows.size()), all.cols());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    some.row(static_cast<Eigen::Index>(r)) = all.row(rows[r]);
  }
  return some;
}

}  // namespace

ConstraintSet TouchingAt(const MechanicalSystem& system, const VectorRef& x, double gap_tolerance) {
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  ConstraintSet touching;
  for (int i = 0; i < system.num_constraints(); ++i) {
    if (!system.compliant().Contains(i) && std::abs(terms.gap(i)) <= gap_tolerance) {
      touching.Insert(i);
    }
  }
  return touching;
}

Matrix HeldRows(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                ConstraintSet touching, const Variables& variables) {
  const int d = system.dof(), nq = system.num_positions(), size = 2 * d + variables.Size(system);
  const int parameters = static_cast<int>(variables.parameters.size());
  std::vector<int> slips;
  RowLayout(system).AddTangential(mode.Sticking(), &slips);
  const ConstraintSet gaps = touching - mode;
  Matrix rows = Matrix::Zero(static_cast<Eigen::Index>(slips.size()) + gaps.Size(), size);
  if (rows.rows() == 0) return rows;
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector no_impulse = Vector::Zero(terms.gap.size());
  ResidualJacobian residual;
  system.DifferentiateImpact(x.head(nq), Vector::Zero(d), no_impulse, x.tail(d), &residual);
  ParameterJacobian by_parameter;
  if (parameters > 0) {
    system.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d), no_impulse, x.tail(d),
                                           variables.parameters, &by_parameter);
  }
  Eigen::Index row = 0;
  for (int i : slips) {
    rows.row(row).head(d) = residual.constraint_q.row(i);
    rows.row(row).segment(d, d) = terms.jacobian.row(i);
    if (parameters > 0) rows.row(row).tail(parameters) = by_parameter.constraint.row(i);
    rows.row(row++).normalize();
  }
  for (int i : gaps) {
    rows.row(row).head(d) = terms.jacobian.row(i);
    if (parameters > 0) rows.row(row).tail(parameters) = by_parameter.gap.row(i);
    rows.row(row++).normalize();
  }
  return rows;
}

Matrix AdmissibleBasis(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                       const Variables& variables, ConstraintSet touching, const Matrix& rows) {
  const int n = 2 * system.dof() + variables.Size(system);
  const Matrix held = HeldRows(system, x, mode, touching, variables);
  Matrix violation = Matrix::Zero(n + held.rows() + rows.rows(), n);
  for (int k = 0; k < n; ++k) {
    const Vector unit = Vector::Unit(n, k);
    violation.col(k).head(n) = unit - ProjectAdmissible(system, x, mode, unit, variables);
  }
  violation.middleRows(n, held.rows()) = held;
  violation.bottomRows(rows.rows()).leftCols(rows.cols()) = rows;
  return violation.isZero(0) ? Matrix::Identity(n, n) : NullSpace(violation);
}

void Retract(const MechanicalSystem& system, ContactMode mode, Vector* x, ConstraintSet touching) {
  const int d = system.dof(), nq = system.num_positions();
  const RowLayout layout(system);
  std::vector<int> closed = layout.Closed(mode - system.compliant());
  std::vector<int> still = closed;
  layout.AddTangential(mode.Sticking(), &still);
  for (int i : touching - mode) closed.push_back(i);
  if (closed.empty()) return;
  Vector moved = *x;
  ConstraintTerms terms;
  const InverseInertia inertia(system, x->head(nq), x->tail(d));
  const std::vector<int> driven = Driven(inertia.mass());  // of these the state is kept
  for (int step = 0; step < kMaxRetractions; ++step) {
    system.Constraints(moved.head(nq), moved.tail(d), &terms);
    Matrix A = SelectedRows(terms.jacobian, closed), rates = SelectedRows(terms.jacobian, still);
    const Vector speeds = rates * moved.tail(d);
    for (int j : driven) A.col(j).setZero(), rates.col(j).setZero();
    const Vector gap = SelectedRows(terms.gap, closed);
    Vector change = Vector::Zero(2 * d);
    change.head(d) = -A.completeOrthogonalDecomposition().solve(gap);
    if (rates.rows() > 0) {
      change.tail(d) = -rates.completeOrthogonalDecomposition().solve(speeds);
    }
    if (!change.allFinite()) return;
    moved = system.Perturb(moved, change);
    if (gap.cwiseAbs().maxCoeff() <= kRetracted) break;
  }
  *x = moved;
}

}  // namespace contact_flow
