// SPDX-License-Identifier: BSD-3-Clause
#include "retraction.h"

#include <Eigen/QR>
#include <vector>

#include "contact_flow/analysis/section.h"
#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {
namespace {

constexpr int kMaxNewton = 20;
constexpr double kClosed = 1e-15;  // [m]

}  // namespace

Matrix AdmissibleBasis(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                       const Variables& variables) {
  const int n = 2 * system.dof() + variables.Size(system);
  Matrix violation(n, n);
  for (int k = 0; k < n; ++k) {
    const Vector unit = Vector::Unit(n, k);
    violation.col(k) = unit - ProjectAdmissible(system, x, mode, unit, variables);
  }
  return violation.isZero(0) ? Matrix::Identity(n, n) : NullSpace(violation);
}

void Retract(const MechanicalSystem& system, ContactMode mode, Vector* x) {
  const int d = system.dof(), nq = system.num_positions();
  std::vector<int> active;
  for (int i : mode - system.compliant()) active.push_back(i);
  for (int i = 0; i < system.num_bilateral(); ++i) active.push_back(system.num_constraints() + i);
  if (active.empty()) return;
  const auto k = static_cast<Eigen::Index>(active.size());
  Vector moved = *x;
  ConstraintTerms terms;
  for (int step = 0; step < kMaxNewton; ++step) {
    system.Constraints(moved.head(nq), moved.tail(d), &terms);
    Matrix A(k, d);
    Vector gap(k);
    for (Eigen::Index row = 0; row < k; ++row) {
      A.row(row) = terms.jacobian.row(active[row]);
      gap(row) = terms.gap(active[row]);
    }
    const Eigen::CompleteOrthogonalDecomposition<Matrix> factor(A);
    Vector change = Vector::Zero(2 * d);
    change.head(d) = -factor.solve(gap);
    change.tail(d) = -factor.solve(A * moved.tail(d));
    if (!change.allFinite()) return;
    moved = system.Perturb(moved, change);
    if (gap.cwiseAbs().maxCoeff() <= kClosed) break;
  }
  *x = moved;
}

}  // namespace contact_flow
