// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/complementarity.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kBasisRounding = 1e-13;
constexpr long kMaxPivots = 100000;  // never met for n ≤ 16: at most 2ⁿ
constexpr double kSemidefiniteRounding = 1e-12;
constexpr int kRoundsForEach = 20;  // row; 3 are usual
/// w_i of a row that depends on others where w = 0 vanishes, too, up to what rounding makes of b:
/// its error is that of M⁻¹ f, so that it grows with the condition of M.
constexpr double kInconsistent = 1e-6;

Matrix Block(const Matrix& G, const std::vector<int>& rows) {
  const int k = static_cast<int>(rows.size());
  Matrix block(k, k);
  for (int i = 0; i < k; ++i) {
    for (int j = 0; j < k; ++j) block(i, j) = G(rows[i], rows[j]);
  }
  return block;
}

/// z on the support with (G z + b)_support = 0; false when that block is not positive definite, or
/// a pivot is below `smallest_pivot`, relative to the diagonal.
bool SolveOnSupport(const Matrix& G, const Vector& b, const ConstraintSet& support,
                    double smallest_pivot, Vector* z) {
  z->setZero(b.size());
  if (support.Empty()) return true;
  std::vector<int> rows;
  for (int i : support) rows.push_back(i);
  const int k = static_cast<int>(rows.size());
  const Matrix block = Block(G, rows);
  const Eigen::LLT<Matrix> factor(block);
  if (factor.info() != Eigen::Success) return false;
  Vector rhs(k);
  for (int i = 0; i < k; ++i) {
    const double pivot = factor.matrixLLT()(i, i);
    if (pivot * pivot < smallest_pivot * block(i, i)) return false;
    rhs(i) = -b(rows[i]);
  }
  const Vector solution = factor.solve(rhs);
  for (int i = 0; i < k; ++i) (*z)(rows[i]) = solution(i);
  return solution.allFinite();
}

using Solution = std::optional<ComplementaritySolution>;

/// z_i = max(0, −b_i/G_ii), the solution when G is diagonal.
Solution SolveDecoupled(const Matrix& G, const Vector& b, double zero) {
  if (!(G.diagonal().array() > 0).all()) return std::nullopt;
  ComplementaritySolution solution;
  solution.z = Vector::Zero(b.size());
  for (int i = 0; i < b.size(); ++i) {
    if (b(i) >= -zero) continue;
    solution.z(i) = -b(i) / G(i, i);
    solution.support.Insert(i);
  }
  if (!solution.z.allFinite()) return std::nullopt;  // G_ii of 1e-310
  return solution;
}

Solution SolveByPivoting(const Matrix& G, const Vector& b, double zero, double smallest_pivot) {
  const int n = static_cast<int>(b.size());
  ComplementaritySolution solution;
  for (long pivot = 0; pivot < kMaxPivots; ++pivot) {
    AskBudget();
    if (!SolveOnSupport(G, b, solution.support, smallest_pivot, &solution.z)) return std::nullopt;
    const Vector w = G * solution.z + b;
    int wrong = -1;
    for (int i = 0; i < n && wrong < 0; ++i) {
      const bool active = solution.support.Contains(i);
      if (active ? solution.z(i) * G(i, i) < -zero : w(i) < -zero) wrong = i;
    }
    if (wrong < 0) {
      solution.z = solution.z.cwiseMax(0.0);
      return solution;
    }
    solution.support = solution.support.Contains(wrong) ? solution.support.Without(wrong)
                                                        : solution.support.With(wrong);
  }
  return std::nullopt;
}

/// min ½ zᵀGz + bᵀz over z ≥ 0 by an active set of independent rows: the most negative w_i comes
/// in, and what would become negative goes out (Lawson and Hanson, 1974). Each round
/// lowers the objective.
class ActiveSet {
 public:
  ActiveSet(const Matrix& G, const Vector& b) : G_(G), b_(b), z_(Vector::Zero(b.size())) {}

  Solution Solve() {
    bool found = false;
    const Vector scale = G_.diagonal().cwiseSqrt();
    const double size = b_.cwiseQuotient(scale).cwiseAbs().maxCoeff();
    const double zero = kSemidefiniteRounding * size, inconsistent = kInconsistent * size;
    const int rounds = kRoundsForEach * static_cast<int>(b_.size() + 1);
    for (int round = 0; round < rounds; ++round) {
      AskBudget();
      const Vector w = (G_ * z_ + b_).cwiseQuotient(scale);
      int next = -1;
      for (int i = 0; i < w.size(); ++i) {
        const bool in = std::count(rows_.begin(), rows_.end(), i) > 0;
        if (in || w(i) >= -zero || (next >= 0 && w(i) >= w(next))) continue;
        if (w(i) >= -inconsistent && Independence(G_, rows_, i) <= kDependentRow) continue;
        next = i;
      }
      if (next < 0) {
        found = z_.allFinite();
        break;
      }
      if (!Enter(next)) break;
      if (!Descend()) break;
    }
    if (!found) return std::nullopt;
    ComplementaritySolution solution;
    solution.z = z_;
    for (int i : rows_) solution.support.Insert(i);
    return solution;
  }

 private:
  /// Adds a row. One that depends on the others is exchanged, along the direction in which G z does
  /// not change; false where nothing stops that: no z ≥ 0 gives w ≥ 0.
  bool Enter(int next) {
    Vector y;
    if (Independence(G_, rows_, next, &y) > kDependentRow) {
      rows_.push_back(next);
      return true;
    }
    int out = -1;
    double t = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (y(k) > 0 && z_(rows_[k]) < t * y(k)) {
        t = z_(rows_[k]) / y(k);
        out = static_cast<int>(k);
      }
    }
    if (out < 0) return false;
    for (std::size_t k = 0; k < rows_.size(); ++k) z_(rows_[k]) -= t * y(k);
    z_(rows_[out]) = 0;
    z_(next) = t;
    rows_[out] = next;
    return true;
  }

  /// To the minimum over the rows, as far as z ≥ 0 allows; rows that reach zero on the way go out.
  bool Descend() {
    while (!rows_.empty()) {
      const Eigen::LLT<Matrix> factor(Block(G_, rows_));
      if (factor.info() != Eigen::Success) return false;
      Vector rhs(rows_.size());
      for (std::size_t k = 0; k < rows_.size(); ++k) rhs(k) = -b_(rows_[k]);
      const Vector goal = factor.solve(rhs);
      double step = 1;
      int out = -1;
      for (std::size_t k = 0; k < rows_.size(); ++k) {
        const double z = z_(rows_[k]);
        if (goal(k) <= 0 && z <= step * (z - goal(k))) {
          step = z > 0 ? z / (z - goal(k)) : 0;
          out = static_cast<int>(k);
        }
      }
      for (std::size_t k = 0; k < rows_.size(); ++k)
        z_(rows_[k]) += step * (goal(k) - z_(rows_[k]));
      if (out < 0) return true;
      z_(rows_[out]) = 0;
      rows_.erase(rows_.begin() + out);
    }
    return true;
  }

  const Matrix& G_;
  const Vector& b_;
  Vector z_;
  std::vector<int> rows_;
};

}  // namespace

Solution SolveComplementarity(const Matrix& G, const Vector& b) {
  const int n = static_cast<int>(b.size());
  const double zero = kBasisRounding * (n > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
  if (!G.allFinite() || !b.allFinite()) return std::nullopt;
  if (G.isDiagonal(0)) return SolveDecoupled(G, b, zero);
  const Solution definite = SolveByPivoting(G, b, zero, kDependentRow);
  if (definite || !(G.diagonal().array() > 0).all()) return definite;
  return ActiveSet(G, b).Solve();
}

double Independence(const Matrix& G, const std::vector<int>& S, int i, Vector* combination) {
  const int k = static_cast<int>(S.size());
  Vector coupling(k);
  for (int row = 0; row < k; ++row) coupling(row) = G(S[row], i);
  Vector y = coupling;
  if (k > 0) {
    const Eigen::LLT<Matrix> factor(Block(G, S));
    const bool definite = factor.info() == Eigen::Success;
    y = definite ? Vector(factor.solve(coupling)) : Vector::Constant(k, std::nan(""));
  }
  if (combination != nullptr) *combination = y;
  return y.allFinite() && G(i, i) > 0 ? std::max(0.0, 1 - coupling.dot(y) / G(i, i)) : 0;
}

}  // namespace contact_flow
