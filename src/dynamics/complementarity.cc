// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/complementarity.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

constexpr double kRounding = 1e-13;
constexpr long kMaxPivots = 100000;  // never met for n ≤ 16: at most 2ⁿ
constexpr double kProximal = 1e-8;   // ε
constexpr int kMaxProximalSteps = 40;
/// What is left where the steps no longer converge, relative to b: that b, the sum of larger
/// numbers, is not quite in the range of G.
constexpr double kInconsistent = 1e-5;

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
bool SolveOnSupport(const Matrix& G, const Vector& b, ContactMode support, double smallest_pivot,
                    Vector* z) {
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

ComplementaritySolution SolveByPivoting(const Matrix& G, const Vector& b, double zero,
                                        double smallest_pivot) {
  const int n = static_cast<int>(b.size());
  ComplementaritySolution solution;
  for (long pivot = 0; pivot < kMaxPivots; ++pivot) {
    if (!SolveOnSupport(G, b, solution.support, smallest_pivot, &solution.z)) return solution;
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

/// z ← argmin ½ zᵀGz + bᵀz + ½ ε |z − z_before|²_D over z ≥ 0, D = diag G, from 0 on.
ComplementaritySolution SolveByProximalSteps(const Matrix& G, const Vector& b, double zero) {
  const Vector weight = kProximal * G.diagonal();
  const Matrix regular = G + Matrix(weight.asDiagonal());
  const double inconsistent = kInconsistent * b.cwiseAbs().maxCoeff();
  Vector z = Vector::Zero(b.size());
  double before = std::numeric_limits<double>::infinity();
  ComplementaritySolution solution;
  for (int step = 0; step < kMaxProximalSteps; ++step) {
    const Vector shifted = b - weight.cwiseProduct(z);
    solution = SolveByPivoting(regular, shifted, zero, 0.1 * kProximal);
    if (!solution.found) break;
    const double residual = weight.cwiseProduct(solution.z - z).cwiseAbs().maxCoeff();
    z = solution.z;
    solution.dependent = true;
    if (residual <= 10 * zero) return solution;
    if (residual > 0.5 * before && residual <= inconsistent) return solution;
    before = residual;
  }
  solution.found = false;
  return solution;
}

}  // namespace

ComplementaritySolution SolveComplementarity(const Matrix& G, const Vector& b) {
  const int n = static_cast<int>(b.size());
  const double zero = kRounding * (n > 0 ? b.cwiseAbs().maxCoeff() : 0.0);
  if (!G.allFinite() || !b.allFinite()) return {};
  if (G.isDiagonal(0)) return SolveDecoupled(G, b, zero);
  const ComplementaritySolution definite = SolveByPivoting(G, b, zero, kDependentRow);
  if (definite.found || !(G.diagonal().array() > 0).all()) return definite;
  const ComplementaritySolution semidefinite = SolveByProximalSteps(G, b, zero);
  return semidefinite.found ? semidefinite : SolveByPivoting(G, b, zero, 0);
}

double Independence(const Matrix& G, const std::vector<int>& S, int i, Vector* combination) {
  const int k = static_cast<int>(S.size());
  Vector coupling(k);
  for (int row = 0; row < k; ++row) coupling(row) = G(S[row], i);
  const Vector y = k > 0 ? Vector(Block(G, S).llt().solve(coupling)) : coupling;
  if (combination != nullptr) *combination = y;
  return G(i, i) > 0 ? std::max(0.0, 1 - coupling.dot(y) / G(i, i)) : 0;
}

std::vector<int> IndependentSupport(const Matrix& G, ContactMode support, Vector* z) {
  std::vector<int> order;
  for (int i : support) order.push_back(i);
  const auto size = [&](int i) { return (*z)(i) * std::sqrt(G(i, i)); };
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return size(i) > size(j); });
  std::vector<int> basis;
  for (int i : order) {
    Vector y;
    if (Independence(G, basis, i, &y) > kDependentRow) {
      basis.push_back(i);
      continue;
    }
    // (z_i − t, z_S + t y) has the same G z: as far as the first of them vanishes.
    double t = (*z)(i);
    int out = -1;
    for (std::size_t k = 0; k < basis.size(); ++k) {
      if (y(k) < 0 && (*z)(basis[k]) < -t * y(k)) {
        t = (*z)(basis[k]) / -y(k);
        out = static_cast<int>(k);
      }
    }
    for (std::size_t k = 0; k < basis.size(); ++k) (*z)(basis[k]) += t * y(k);
    if (out < 0) {
      (*z)(i) = 0;
    } else {
      (*z)(i) -= t;
      (*z)(basis[out]) = 0;
      basis[out] = i;
    }
  }
  return basis;
}

}  // namespace contact_flow
