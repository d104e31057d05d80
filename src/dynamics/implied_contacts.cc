// SPDX-License-Identifier: BSD-3-Clause
#include "implied_contacts.h"

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// Places of independent ones among `rows`, G being the Gram matrix of all.
std::vector<int> Independent(const Matrix& G, const std::vector<int>& rows) {
  std::vector<int> basis;
  for (int row : rows) {
    if (Independence(G, basis, row) > kDependentRow) basis.push_back(row);
  }
  return basis;
}

/// Of speeds that the ground gives: below this part of their terms they are the same.
constexpr double kSameGround = 1e-9;

/// Whether row k depends on those of `basis`, G being the Gram matrix of what is moved, and moves
/// as they do with what is driven (v with zeros elsewhere): two floors may move apart.
bool Depends(const Matrix& rows, const Matrix& G, const std::vector<int>& basis, int k,
             const Vector& driven) {
  Vector by;
  if (Independence(G, basis, k, &by) > kDependentRow) return false;
  if (driven.isZero(0)) return true;
  const Vector speeds = rows * driven, sizes = rows.cwiseAbs() * driven.cwiseAbs();
  double apart = speeds(k), size = sizes(k);
  for (std::size_t j = 0; j < basis.size(); ++j) {
    const double part = by(static_cast<Eigen::Index>(j));
    apart -= part * speeds(basis[j]);
    size += std::abs(part) * sizes(basis[j]);
  }
  return std::abs(apart) <= kSameGround * size;
}

/// Of a Gram matrix whose rows may depend on each other.
Eigen::CompleteOrthogonalDecomposition<Matrix> Factorize(const Matrix& G) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> factor(G.rows(), G.cols());
  factor.setThreshold(kDependentRow);
  factor.compute(G);
  return factor;
}

}  // namespace

ConstraintSet ImpliedClosed(const MechanicalSystem& system, const Vector& x,
                            const ConstraintSet& closed, const ConstraintSet& near) {
  if (closed.Empty() || near.Empty()) return {};
  const int nq = system.num_positions();
  const InverseInertia inertia(system, x.head(nq), x.tail(system.dof()));
  const ConstraintSet all = closed | near;
  const Matrix A = inertia.Rows(all);
  const Matrix G = A * (inertia * A.transpose());
  std::vector<int> members, constraints;
  for (int i : all) {
    if (closed.Contains(i)) members.push_back(static_cast<int>(constraints.size()));
    constraints.push_back(i);
  }
  const std::vector<int> basis = Independent(G, members);
  const Vector v = x.tail(system.dof()), driven = v - Moved(inertia.mass(), v);
  ConstraintSet implied;
  for (std::size_t k = 0; k < constraints.size(); ++k) {
    if (closed.Contains(constraints[k])) continue;
    if (Depends(A, G, basis, static_cast<int>(k), driven)) implied.Insert(constraints[k]);
  }
  return implied;
}

ConstraintSet ImpliedStill(const MechanicalSystem& system, const Vector& x,
                           const ConstraintSet& closed, const ConstraintSet& still) {
  if ((closed - still).Empty()) return {};
  const int nq = system.num_positions();
  const InverseInertia inertia(system, x.head(nq), x.tail(system.dof()));
  const FrictionFrame frame(system, inertia, closed);
  const FrictionProblem& problem = frame.problem();
  std::vector<int> held;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    held.push_back(problem.Row(k));
    for (int j = 1; j <= problem.contacts[k].dimension; ++j) {
      if (still.Contains(frame.constraints()[k])) held.push_back(problem.Row(k) + j);
    }
  }
  const std::vector<int> basis = Independent(problem.G, held);
  const Vector v = x.tail(system.dof()), driven = v - Moved(inertia.mass(), v);
  ConstraintSet implied;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int i = frame.constraints()[k], dimension = problem.contacts[k].dimension;
    if (still.Contains(i) || dimension == 0) continue;
    bool all = true;
    for (int j = 1; all && j <= dimension; ++j) {
      all = Depends(frame.rows(), problem.G, basis, problem.Row(k) + j, driven);
    }
    if (all) implied.Insert(i);
  }
  return implied;
}

void MakeRest(const MechanicalSystem& system, const ContactMode& mode,
              const std::map<int, Eigen::Vector2d>& onsets, Vector* x) {
  const int nq = system.num_positions(), d = system.dof();
  std::vector<int> rows, begun;
  std::vector<double> slips;
  for (int i : mode) {
    rows.push_back(i);
    if (!system.HasFriction()) continue;
    const Friction& friction = system.friction()[i];
    const bool begins = onsets.count(i) > 0;
    for (int k = 0; k < friction.dimension; ++k) {
      if (begins) {
        begun.push_back(friction.row + k);
        slips.push_back(onsets.at(i)(k));
      } else if (mode.LetterOf(i) == Letter::kStick) {
        rows.push_back(friction.row + k);
      }
    }
  }
  if (rows.empty()) return;
  const InverseInertia inertia(system, x->head(nq), x->tail(d));
  const auto pick = [&](const std::vector<int>& which) {
    Matrix A(static_cast<Eigen::Index>(which.size()), d);
    for (std::size_t r = 0; r < which.size(); ++r) {
      A.row(static_cast<Eigen::Index>(r)) = inertia.terms().jacobian.row(which[r]);
    }
    return A;
  };
  const Matrix A = pick(rows);
  const Matrix reach = inertia * A.transpose();
  const Eigen::CompleteOrthogonalDecomposition<Matrix> rest = Factorize(A * reach);
  const Vector rate = A * x->tail(d);
  if (!rate.isZero(0)) x->tail(d) -= reach * rest.solve(rate);
  if (begun.empty()) return;
  // By what moves nothing that rests: slips of one body depend on each other.
  const Matrix B = pick(begun);
  Matrix move = inertia * B.transpose();
  move -= reach * rest.solve(A * move);
  const Vector missing =
      Vector::Map(slips.data(), static_cast<Eigen::Index>(slips.size())) - B * x->tail(d);
  x->tail(d) += move * Factorize(B * move).solve(missing);
}

}  // namespace contact_flow
