// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/manifold_projection.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/row_layout.h"
#include "src/dynamics/dependent_rows.h"

namespace contact_flow {
namespace {

constexpr int kMaxProjections = 30;
constexpr double kClosed = 1e-14;   // [m] a closure to rounding
constexpr double kContact = 1e-12;  // [m] a contact, likewise

/// What takes away `rates`, as far as they are combinations of what the rows can have: dependent
/// rows are those that are so in the dynamics.
Vector TakeAway(const Matrix& G, const Vector& rates) {
  const bool comparable = G.allFinite() && (G.diagonal().array() > 0).all();
  if (comparable) {
    const RowBasis basis = FindRowBasis(G);
    if (basis.freedom.cols() > 0) return basis.PseudoInverse() * rates;
  }
  return G.completeOrthogonalDecomposition().solve(rates);
}

std::vector<int> HeldRowsOf(const MechanicalSystem& system, ContactMode held) {
  const RowLayout layout(system);
  std::vector<int> rows = layout.Closed(held - system.compliant());
  layout.AddTangential(held.Sticking() - system.compliant(), &rows);
  return rows;
}

}  // namespace

bool HasStateManifold(const MechanicalSystem& system) {
  return system.num_bilateral() > 0 || !system.space().IsFlat();
}

bool ProjectState(const MechanicalSystem& system, Vector* x, double farthest) {
  const int d = system.dof(), nq = system.num_positions();
  const RowLayout rows(system);
  system.space().Normalize(x->data());
  if (rows.bilateral() == 0) return x->allFinite();
  double last = 0, moved = 0;
  for (int step = 0; step < kMaxProjections; ++step) {
    const InverseInertia inertia(system, x->head(nq), x->tail(d));
    const Vector b = rows.Bilateral(inertia.terms().gap);
    const double error = b.cwiseAbs().maxCoeff();
    if (!(error < 1e3)) return false;
    const bool stalled = step > 1 && error >= 0.5 * last && error < 1e-11;
    if (error <= kClosed || stalled) {
      x->tail(d) += inertia.Correction(rows.Bilateral(inertia.terms().jacobian) * x->tail(d));
      return x->allFinite();
    }
    const Vector correction = inertia.Correction(b);
    moved += correction.cwiseAbs().maxCoeff();
    if (!(moved <= farthest)) return false;
    x->head(nq) = system.space().Retract(x->head(nq), correction);
    last = error;
  }
  return false;
}

bool ProjectContacts(const MechanicalSystem& system, ContactMode held, Vector* x) {
  const int d = system.dof(), nq = system.num_positions();
  const RowLayout layout(system);
  std::vector<int> rows = layout.Closed(held - system.compliant());
  if (rows.empty()) return true;
  const auto k = static_cast<Eigen::Index>(rows.size());
  rows = HeldRowsOf(system, held);
  const auto all = static_cast<Eigen::Index>(rows.size());
  Vector y = *x;
  Matrix A(all, d), mass;
  Vector gap(k), applied;
  ConstraintTerms terms;
  const Vector u = Vector::Zero(system.num_inputs());
  for (int step = 0; step < kMaxProjections; ++step) {
    system.space().Normalize(y.data());
    system.ConstraintsOf(held, y.head(nq), y.tail(d), &terms);
    for (Eigen::Index r = 0; r < all; ++r) {
      A.row(r) = terms.jacobian.row(rows[static_cast<std::size_t>(r)]);
      if (r < k) gap(r) = terms.gap(rows[static_cast<std::size_t>(r)]);
    }
    system.Dynamics(y.head(nq), y.tail(d), u, held, &mass, &applied);
    const Matrix reach = mass.llt().solve(A.transpose());  // shortest in the kinetic metric
    const Matrix G = A * reach;
    if (gap.cwiseAbs().maxCoeff() <= kContact) {
      y.tail(d) -= reach * TakeAway(G, A * y.tail(d));
      if (!y.allFinite()) return false;
      *x = y;
      return true;
    }
    const Vector change = G.topLeftCorner(k, k).completeOrthogonalDecomposition().solve(gap);
    y.head(nq) = system.space().Retract(y.head(nq), -(reach.leftCols(k) * change));
  }
  return false;
}

HeldRates RatesOfHeld(const MechanicalSystem& system, ContactMode held, const Vector& x) {
  const int d = system.dof(), nq = system.num_positions();
  HeldRates held_rates;
  held_rates.rows = HeldRowsOf(system, held);
  const auto all = static_cast<Eigen::Index>(held_rates.rows.size());
  held_rates.left = Vector::Zero(all);
  held_rates.change = Vector::Zero(d);
  if (all == 0) return held_rates;
  ConstraintTerms terms;
  system.ConstraintsOf(held, x.head(nq), x.tail(d), &terms);
  Matrix A(all, d), mass;
  Vector applied;
  for (Eigen::Index r = 0; r < all; ++r) {
    A.row(r) = terms.jacobian.row(held_rates.rows[static_cast<std::size_t>(r)]);
  }
  system.Dynamics(x.head(nq), x.tail(d), Vector::Zero(system.num_inputs()), held, &mass, &applied);
  const Matrix reach = mass.llt().solve(A.transpose());
  const Matrix G = A * reach;
  const Vector rates = A * x.tail(d);
  const Vector impulse = TakeAway(G, rates);
  held_rates.change = -(reach * impulse);
  held_rates.left = rates + A * held_rates.change;
  const double alone = (rates.cwiseAbs2().cwiseQuotient(G.diagonal())).maxCoeff();
  const double together = impulse.dot(G * impulse);
  held_rates.amplified = alone > 0 ? std::sqrt(std::max(0.0, together) / alone) : 0;
  return held_rates;
}

}  // namespace contact_flow
