// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/complementarity.h"

#include <Eigen/Cholesky>
#include <vector>

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-13;
constexpr long kMaxPivots = 100000;  // never met for n ≤ 16: at most 2ⁿ

/// z on the support with (G z + b)_support = 0; false when that block is not positive definite.
bool SolveOnSupport(const Matrix& G, const Vector& b, ContactMode support, Vector* z) {
  z->setZero(b.size());
  if (support.Empty()) return true;
  std::vector<int> rows;
  for (int i : support) rows.push_back(i);
  const int k = static_cast<int>(rows.size());
  Matrix block(k, k);
  Vector rhs(k);
  for (int i = 0; i < k; ++i) {
    rhs(i) = -b(rows[i]);
    for (int j = 0; j < k; ++j) block(i, j) = G(rows[i], rows[j]);
  }
  const Eigen::LLT<Matrix> factor(block);
  if (factor.info() != Eigen::Success) return false;
  const Vector solution = factor.solve(rhs);
  for (int i = 0; i < k; ++i) (*z)(rows[i]) = solution(i);
  return solution.allFinite();
}

/// z_i = max(0, −b_i/G_ii), the solution when G is diagonal.
ComplementaritySolution SolveDecoupled(const Matrix& G, const Vector& b, double zero) {
  ComplementaritySolution solution;
  solution.z = Vector::Zero(b.size());
  solution.found = (G.diagonal().array() > 0).all();
  for (int i = 0; i < b.size(); ++i) {
    if (b(i) >= -zero) continue;
    solution.z(i) = -b(i) / G(i, i);
    solution.support.Insert(i);
  }
  return solution;
}

}  // namespace

ComplementaritySolution SolveComplementarity(const Matrix& G, const Vector& b) {
  const int n = static_cast<int>(b.size());
  const double zero = kRounding * (n > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
  ComplementaritySolution solution;
  if (!G.allFinite() || !b.allFinite()) return solution;
  if (G.isDiagonal(0)) return SolveDecoupled(G, b, zero);
  for (long pivot = 0; pivot < kMaxPivots; ++pivot) {
    if (!SolveOnSupport(G, b, solution.support, &solution.z)) return solution;
    const Vector w = G * solution.z + b;
    int wrong = -1;
    for (int i = 0; i < n && wrong < 0; ++i) {
      const bool active = solution.support.Contains(i);
      if (active ? solution.z(i) * G(i, i) < -zero : w(i) < -zero) wrong = i;
    }
    if (wrong < 0) {
      solution.z = solution.z.cwiseMax(0.0);
      solution.found = true;
      return solution;
    }
    solution.support = solution.support.Contains(wrong) ? solution.support.Without(wrong)
                                                        : solution.support.With(wrong);
  }
  return solution;
}

}  // namespace contact_flow
