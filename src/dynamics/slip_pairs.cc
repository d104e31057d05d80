// SPDX-License-Identifier: BSD-3-Clause
#include "slip_pairs.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>

#include "slip_circle.h"
#include "slip_newton.h"

namespace contact_flow {
namespace {

/// Angles with a smaller imaginary part may be those of roots, perturbed [rad].
constexpr double kNearReal = 0.02;
/// Bases of the first contact [rad] that are tried where the pencil's eigenvalues are not found.
constexpr double kBases[] = {0, 1.1, 2.3};
constexpr int kSylvester = 6, kPowers = 4, kPencil = kSylvester * kPowers;

/// λ_n, λ_t and y_t of the two, each affine in four numbers z: what the equations without
/// directions leave. The last column is what they are at z = 0.
using PairAffine = Eigen::Matrix<double, 10, 5>;

bool CondensePair(const FrictionProblem& problem, const FrictionSolution& word,
                  const std::vector<int>& pair, PairAffine* affine) {
  const HeldEquations others(problem, word, pair);
  const auto m = static_cast<Eigen::Index>(others.rows.size());
  std::vector<int> rows = others.rows, forces = others.rows;
  for (int k : pair) {
    const int row = problem.Row(static_cast<std::size_t>(k));
    rows.push_back(row);
    for (int j = 0; j < 3; ++j) forces.push_back(row + j);
  }
  Matrix columns = Matrix::Zero(problem.b.size(), m + 6);
  columns.leftCols(m) = others.columns;
  for (Eigen::Index c = m; c < m + 6; ++c) columns(forces[static_cast<std::size_t>(c)], c) = 1;
  const Vector unit = problem.G.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix push = problem.G * columns * unit(forces).asDiagonal();
  const Matrix held = unit(rows).asDiagonal() * push(rows, Eigen::all);
  if (!held.allFinite()) return false;
  const Eigen::FullPivLU<Matrix> factor(held);
  if (factor.rank() < m + 2) return false;
  Matrix all(m + 6, 5);
  all << factor.kernel(), factor.solve(Vector(-unit(rows).cwiseProduct(problem.b(rows))));
  for (int k = 0; k < 2; ++k) {
    const int row = problem.Row(static_cast<std::size_t>(pair[static_cast<std::size_t>(k)]));
    affine->middleRows<3>(5 * k) = unit.segment<3>(row).asDiagonal() * all.middleRows<3>(m + 3 * k);
    affine->middleRows<2>(5 * k + 3) = push.middleRows<2>(row + 1) * all;
    affine->block<2, 1>(5 * k + 3, 4) += problem.b.segment<2>(row + 1);
  }
  return affine->allFinite();
}

/// 1 + x², 1 − x², 2 x: what 1 and d are, times 1 + x².
constexpr double kCircle[3][3] = {{1, 0, 1}, {1, 0, -1}, {0, 2, 0}};

/// The coefficients of F of the first of (own, other), by powers of its x and the other's.
std::array<std::array<double, 3>, 5> Across(const PairAffine& affine, const double* mu, int own) {
  const int first = 5 * own, second = 5 - first;
  // The two rows λ_t + μ λ_n d of a contact, without d and by its entries.
  const int choice[3][2] = {{1, 2}, {0, 2}, {1, 0}};
  std::array<std::array<double, 3>, 5> sum = {};
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      Eigen::Matrix<double, 5, 5> minor;
      for (int j = 0; j < 2; ++j) {
        minor.row(j) = affine.row(first + choice[a][j]);
        minor.row(2 + j) = affine.row(second + choice[b][j]);
      }
      const double weight = (a > 0 ? mu[own] : 1) * (b > 0 ? mu[1 - own] : 1);
      for (int i = 0; i < 2; ++i) {  // d⊥ = (−d₂, d₁)
        minor.row(4) = affine.row(first + 3 + i);
        const double value = (i == 0 ? -weight : weight) * minor.determinant();
        for (int p = 0; p < 3; ++p) {
          for (int q = 0; q < 3; ++q) {
            const double own_part = value * kCircle[a][p] * kCircle[2 - i][q];
            for (int r = 0; r < 3; ++r) {
              sum[static_cast<std::size_t>(p + q)][static_cast<std::size_t>(r)] +=
                  own_part * kCircle[b][r];
            }
          }
        }
      }
    }
  }
  double largest = 0;
  for (const auto& row : sum) {
    for (double value : row) largest = std::max(largest, std::abs(value));
  }
  if (!(largest > 0)) return sum;
  for (auto& row : sum) {
    for (double& value : row) value /= largest;
  }
  return sum;
}

/// The same in a basis of the first contact that is turned by `angle`.
PairAffine Turned(const PairAffine& affine, double angle) {
  const Eigen::Matrix2d turn = Eigen::Rotation2Dd(-angle).toRotationMatrix();
  PairAffine turned = affine;
  turned.middleRows<2>(1) = turn * affine.middleRows<2>(1);
  turned.middleRows<2>(3) = turn * affine.middleRows<2>(3);
  return turned;
}

/// Appends the angle of the eigenvalue x = alpha / beta, where it is near a real one.
void AddAngle(const std::complex<double>& alpha, double beta, std::vector<double>* angles) {
  const double size = std::norm(alpha) + beta * beta;
  if (!(size > 0) || 2 * std::abs(alpha.imag() * beta) > kNearReal * size) return;
  angles->push_back(2 * std::atan2(alpha.real(), beta));
}

/// ψ_u at which both have a root ψ_v in common. False where they are not found.
bool CommonAngles(const PairAffine& affine, const double* mu, std::vector<double>* angles) {
  const auto u = Across(affine, mu, 0), v = Across(affine, mu, 1);
  // S(x) = Σ S_k xᵏ; four rows of F_u, of degree 2 in y, and two of F_v (1 + x²), of degree 4: no
  // eigenvalue is infinite for lack of powers.
  Matrix S[kPowers + 1];
  for (int power = 0; power <= kPowers; ++power) {
    S[power] = Matrix::Zero(kSylvester, kSylvester);
    for (int r = 0; r < 4; ++r) {
      for (int q = 0; q < 3; ++q) {
        S[power](r, r + q) = u[static_cast<std::size_t>(power)][static_cast<std::size_t>(q)];
      }
    }
    for (int r = 0; r < 2; ++r) {
      for (int q = 0; q < 5; ++q) {
        const auto& by_x = v[static_cast<std::size_t>(q)];
        S[power](4 + r, r + q) = (power < 3 ? by_x[static_cast<std::size_t>(power)] : 0) +
                                 (power > 1 ? by_x[static_cast<std::size_t>(power - 2)] : 0);
      }
    }
  }
  Matrix A = Matrix::Zero(kPencil, kPencil), B = Matrix::Identity(kPencil, kPencil);
  const int last = kPencil - kSylvester;
  for (int power = 0; power < kPowers; ++power) {
    A.block<kSylvester, kSylvester>(last, kSylvester * power) = -S[power];
  }
  A.topRightCorner(last, last).setIdentity();
  B.bottomRightCorner<kSylvester, kSylvester>() = S[kPowers];
  if (!A.allFinite() || !B.allFinite()) return false;
  Eigen::RealQZ<Matrix> pencil(kPencil);
  pencil.compute(A, B, false);
  if (pencil.info() != Eigen::Success) return false;
  const Matrix &P = pencil.matrixS(), &Q = pencil.matrixT();
  for (int k = 0; k < kPencil; ++k) {
    if (k + 1 == kPencil || P(k + 1, k) == 0) {
      AddAngle(P(k, k), Q(k, k), angles);
      continue;
    }
    // A conjugate pair, with a diagonal block of Q.
    const double beta = Q(k, k) * Q(k + 1, k + 1);
    const Eigen::Matrix2d block =
        P.block<2, 2>(k, k) * Eigen::Vector2d(Q(k + 1, k + 1), Q(k, k)).asDiagonal();
    const double half = 0.5 * (block(0, 0) - block(1, 1));
    const double root = std::sqrt(std::abs(half * half + block(1, 0) * block(0, 1)));
    AddAngle({block(1, 1) + half, root}, beta, angles);
    ++k;
  }
  return true;
}

}  // namespace

bool SlipDirectionsOfTwo(const FrictionProblem& problem, const FrictionSolution& word,
                         const std::vector<int>& pair, std::vector<FrictionSolution>* starts) {
  PairAffine affine;
  if (!CondensePair(problem, word, pair, &affine)) return false;
  const auto first = static_cast<std::size_t>(pair[0]), second = static_cast<std::size_t>(pair[1]);
  const double mu[2] = {problem.contacts[first].coefficient, problem.contacts[second].coefficient};
  for (double basis : kBases) {
    std::vector<double> angles;
    if (!CommonAngles(Turned(affine, basis), mu, &angles)) continue;
    for (double angle : angles) {
      FrictionSolution start = word;
      start.directions[first] = {std::cos(basis + angle), std::sin(basis + angle)};
      for (const Eigen::Vector2d& d : SlipDirectionsOfOne(problem, start, pair[1])) {
        start.directions[second] = d;
        starts->push_back(start);
      }
    }
    return true;
  }
  return false;
}

}  // namespace contact_flow
