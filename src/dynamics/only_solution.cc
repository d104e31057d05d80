// SPDX-License-Identifier: BSD-3-Clause
#include "only_solution.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace contact_flow {
namespace {

/// By how much the matrix is to be positive, in normalized rows.
constexpr double kPositive = 0.01;

/// κ of contact i; infinite where nothing is known.
double Ratio(const FrictionProblem& problem, const FrictionSolution& solution, std::size_t i) {
  const FrictionContact& contact = problem.contacts[i];
  if (contact.dimension == 0) return 0;
  if (solution.letters[i] != Letter::kStick) return contact.coefficient;
  const int row = problem.Row(i);
  return solution.force.segment(row + 1, contact.dimension).norm() / solution.force(row);
}

}  // namespace

bool IsOnlySolution(const FrictionProblem& problem, const FrictionSolution& solution) {
  const Eigen::Index size = problem.b.size();
  const Vector unit = problem.G.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix G = unit.asDiagonal() * problem.G * unit.asDiagonal();
  const Eigen::LLT<Matrix> factor(G - kPositive * Matrix::Identity(size, size));
  if (factor.info() != Eigen::Success) return false;
  const Matrix inverse = factor.solve(Matrix::Identity(size, size));
  Matrix rest = G - kPositive * Matrix::Identity(size, size);
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const int n = problem.Row(i), count = problem.contacts[i].dimension;
    // In normalized rows T is D T, D the ratios of their units to that of N.
    const Vector turn = unit(n) * unit.segment(n + 1, count).cwiseInverse();
    const Matrix push = turn.asDiagonal() * G.middleRows(n + 1, count);
    const double kappa = Ratio(problem, solution, i);
    if (kappa == 0) continue;
    if (!std::isfinite(kappa)) return false;
    const double largest = (push.middleCols(n + 1, count) * turn.asDiagonal()).trace();
    const double theta = std::sqrt(largest / inverse(n, n));
    rest(n, n) -= 0.5 * kappa * theta;
    rest.noalias() -= (0.5 * kappa / theta) * push.transpose() * push;
  }
  return Eigen::LLT<Matrix>(rest).info() == Eigen::Success;
}

}  // namespace contact_flow
