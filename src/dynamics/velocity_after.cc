// SPDX-License-Identifier: BSD-3-Clause
// The velocity after a frictional impact, also where a part is light beside what contacts hold
// it to: by P Aᵀ alone it loses as many digits as G = A P Aᵀ is worse conditioned than (F6).
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/row_layout.h"

namespace contact_flow {
namespace {

/// A pivot of G below this part of its diagonal.
constexpr double kPoorVelocity = 1e-3;

/// The equations that a word adds to M (v⁺ − v⁻) = W p + Bᵀ r: those of contacts that it holds.
struct HeldRows {
  std::vector<Eigen::Index> rows;  // of the frame: N, and T of what sticks
  Matrix push;                     // W [d×·], with what slips in N's columns
};

HeldRows RowsOf(const FrictionProblem& problem, const FrictionSolution& solution, const Matrix& A) {
  HeldRows held;
  held.push.resize(A.cols(), A.rows());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (solution.letters[k] == Letter::kOpen) continue;
    const FrictionContact& contact = problem.contacts[k];
    const Eigen::Index row = problem.Row(k);
    const bool sticks = solution.letters[k] == Letter::kStick;
    Vector push = A.row(row).transpose();
    for (int j = 0; j < contact.dimension && !sticks; ++j) {
      push -= contact.coefficient * solution.directions[k](j) * A.row(row + 1 + j).transpose();
    }
    for (int j = 0; j <= (sticks ? contact.dimension : 0); ++j) {
      held.push.col(static_cast<Eigen::Index>(held.rows.size())) =
          j == 0 ? push : Vector(A.row(row + j).transpose());
      held.rows.push_back(row + j);
    }
  }
  held.push.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(held.rows.size()));
  return held;
}

bool IsPoor(const Matrix& G, const std::vector<Eigen::Index>& rows) {
  const Matrix held = G(rows, rows);
  const Eigen::LLT<Matrix> factor(held);
  if (factor.info() != Eigen::Success) return false;  // dependent rows: v⁺ is that of any p
  const Vector pivots = factor.matrixLLT().diagonal();
  return (pivots.array().square() <= kPoorVelocity * held.diagonal().array()).any();
}

}  // namespace

Vector FrictionFrame::VelocityAfter(const InverseInertia& inertia, const Vector& v_minus,
                                    FrictionSolution* solution) const {
  Vector v_plus = v_minus + reach_ * solution->force;
  if (solution->interior.size() > 0 || solution->many || solution->springs) return v_plus;
  const HeldRows held = RowsOf(problem_, *solution, rows_);
  if (held.rows.empty() || !IsPoor(problem_.G, held.rows)) return v_plus;
  const Eigen::Index d = rows_.cols(), m = held.push.cols(), l = system_.num_bilateral();
  const auto B = RowLayout(system_).Bilateral(inertia.terms().jacobian);
  Matrix kkt = Matrix::Zero(d + m + l, d + m + l);
  kkt.topLeftCorner(d, d) = inertia.mass();
  kkt.block(0, d, d, m) = -held.push;
  kkt.topRightCorner(d, l) = -B.transpose();
  kkt.block(d, 0, m, d) = rows_(held.rows, Eigen::all);
  kkt.bottomLeftCorner(l, d) = B;
  Vector target(d + m + l);  // of v⁺, p and r
  target << inertia.mass() * v_minus, (rows_ * v_minus - problem_.b)(held.rows), B * v_minus;
  const Vector answer = kkt.partialPivLu().solve(target);
  if (!answer.allFinite()) return v_plus;
  for (Eigen::Index r = 0; r < m; ++r) solution->force(held.rows[r]) = answer(d + r);
  for (std::size_t k = 0; k < problem_.contacts.size(); ++k) {
    if (solution->letters[k] == Letter::kOpen || solution->letters[k] == Letter::kStick) continue;
    const FrictionContact& contact = problem_.contacts[k];
    const Eigen::Index row = problem_.Row(k);
    for (int j = 0; j < contact.dimension; ++j) {
      solution->force(row + 1 + j) =
          -contact.coefficient * solution->directions[k](j) * solution->force(row);
    }
  }
  return answer.head(d);
}

}  // namespace contact_flow
