// SPDX-License-Identifier: BSD-3-Clause
// (F4) held against itself: every solution meets it, there is one, and as many as determinants say.
#include "contact_flow/dynamics/friction_problem.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

namespace contact_flow {
namespace {

/// How far a solution is from (F4), by the definition.
double Violation(const FrictionProblem& problem, const FrictionSolution& s) {
  const Vector y = problem.G * s.force + problem.b;
  double worst = 0;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const int row = problem.Row(i), k = problem.contacts[i].dimension;
    const double mu = problem.contacts[i].coefficient;
    const double normal = s.force(row);
    const Vector tangential = s.force.segment(row + 1, k), slip = y.segment(row + 1, k);
    worst = std::max({worst, -normal, -y(row), std::abs(normal * y(row))});
    worst = std::max(worst, tangential.norm() - mu * normal);
    // Maximal dissipation: λ_t · y_t = −μ λ_n |y_t|.
    worst = std::max(worst, std::abs(tangential.dot(slip) + mu * normal * slip.norm()));
  }
  return worst;
}

class RandomProblems {
 public:
  explicit RandomProblems(unsigned seed) : random_(seed) {}

  FrictionProblem Draw(int contacts, int dimension) {
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0, 1);
    const int size = contacts * (1 + dimension);
    Matrix A(size, size + 2);
    for (double& entry : A.reshaped()) entry = normal(random_);
    FrictionProblem problem;
    problem.G = A * A.transpose() / size;
    problem.b.resize(size);
    for (double& entry : problem.b) entry = normal(random_);
    for (int i = 0; i < contacts; ++i) {
      FrictionContact contact;
      contact.coefficient = 3 * uniform(random_);
      contact.dimension = dimension;
      problem.contacts.push_back(contact);
    }
    return problem;
  }

 private:
  std::mt19937 random_;
};

/// Whether all letters' matrices are positively oriented (Kuhn and Löwen): then there is one
/// solution for every b.
bool CoherentlyOriented(const FrictionProblem& problem) {
  const int n = static_cast<int>(problem.contacts.size());
  for (int word = 0; word < (1 << (2 * n)); ++word) {
    std::vector<int> rows;
    Matrix columns = Matrix::Zero(2 * n, 2 * n);
    for (int i = 0; i < n; ++i) {
      const int letter = word >> (2 * i) & 3;  // o, s, +, −
      if (letter == 0) continue;
      columns(2 * i, static_cast<int>(rows.size())) = 1;
      if (letter >= 2) {
        columns(2 * i + 1, static_cast<int>(rows.size())) =
            (letter == 2 ? -1 : 1) * problem.contacts[i].coefficient;
      }
      rows.push_back(2 * i);
      if (letter == 1) {
        columns(2 * i + 1, static_cast<int>(rows.size())) = 1;
        rows.push_back(2 * i + 1);
      }
    }
    const int m = static_cast<int>(rows.size());
    Matrix H(m, m);
    const Matrix push = problem.G * columns;
    for (int r = 0; r < m; ++r) H.row(r) = push.row(rows[r]).head(m);
    if (m > 0 && !(H.determinant() > 0)) return false;
  }
  return true;
}

TEST(FrictionProblem, InThePlaneAsManyAsDeterminantsSay) {
  RandomProblems random(1);
  int unique = 0, others = 0, several = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const FrictionProblem problem = random.Draw(1 + trial % 3, 1);
    const auto solutions = SolveFriction(problem);
    ASSERT_FALSE(solutions.empty()) << "trial " << trial;  // with free directions there is one
    for (const FrictionSolution& s : solutions) EXPECT_LT(Violation(problem, s), 1e-9);
    if (CoherentlyOriented(problem)) {
      ++unique;
      EXPECT_EQ(1u, solutions.size()) << "trial " << trial;
    } else {
      ++others;
      several += solutions.size() > 1;
    }
  }
  EXPECT_GT(unique, 60);
  EXPECT_GT(others, 20);
  EXPECT_GT(several, 0);  // the test can fail
}

TEST(FrictionProblem, InSpace) {
  RandomProblems random(2);
  for (int trial = 0; trial < 120; ++trial) {
    const FrictionProblem problem = random.Draw(1 + trial % 2, 2);
    const auto solutions = SolveFriction(problem);
    ASSERT_FALSE(solutions.empty()) << "trial " << trial;
    for (const FrictionSolution& s : solutions) EXPECT_LT(Violation(problem, s), 1e-8);
  }
}

/// A turn of the tangent basis turns the forces, no more.
TEST(FrictionProblem, NoTangentBasisIsSpecial) {
  RandomProblems random(3);
  for (int trial = 0; trial < 40; ++trial) {
    const FrictionProblem problem = random.Draw(1, 2);
    Matrix turn = Matrix::Identity(3, 3);
    turn.bottomRightCorner<2, 2>() << std::cos(0.7), -std::sin(0.7), std::sin(0.7), std::cos(0.7);
    FrictionProblem turned = problem;
    turned.G = turn * problem.G * turn.transpose();
    turned.b = turn * problem.b;
    const auto one = SolveFriction(problem), other = SolveFriction(turned);
    ASSERT_EQ(one.size(), other.size());
    for (const FrictionSolution& s : one) {
      double nearest = 1;
      for (const FrictionSolution& t : other) {
        nearest = std::min(nearest, (turn * s.force - t.force).cwiseAbs().maxCoeff());
      }
      EXPECT_LT(nearest, 1e-9);
    }
  }
}

}  // namespace
}  // namespace contact_flow
