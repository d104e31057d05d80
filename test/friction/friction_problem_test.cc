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

/// Distinct forces among solutions.
std::vector<Vector> Forces(const std::vector<FrictionSolution>& solutions) {
  std::vector<Vector> forces;
  for (const FrictionSolution& s : solutions) {
    bool known = false;
    for (const Vector& force : forces) known = known || (force - s.force).norm() < 1e-7;
    if (!known) forces.push_back(s.force);
  }
  return forces;
}

/// All words in the plane, one by one, judged by the definition alone: a search that ends with a
/// solution shown to be the only one has left none out.
TEST(FrictionProblem, NoSolutionIsLeftOut) {
  RandomProblems random(4);
  const Letter letters[] = {Letter::kOpen, Letter::kStick, Letter::kForward, Letter::kBackward};
  int several = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const int n = 1 + trial % 4;
    FrictionProblem problem = random.Draw(n, 1);
    const bool tame = trial % 2 == 1;  // hardly coupled, little friction, or much that is not used
    if (tame) problem.G += 2 * Matrix(problem.G.diagonal().asDiagonal());
    for (FrictionContact& contact : problem.contacts) contact.coefficient *= tame ? 0.4 : 3;
    std::vector<FrictionSolution> all;
    for (int word = 0; word < (1 << (2 * n)); ++word) {
      FrictionSolution s;
      for (int i = 0; i < n; ++i) {
        s.letters.push_back(letters[word >> (2 * i) & 3]);
        s.directions.emplace_back(s.letters.back() == Letter::kBackward ? -1 : 1, 0);
      }
      if (SolveWord(problem, &s) && Violation(problem, s) < 1e-9) all.push_back(s);
    }
    several += Forces(all).size() > 1;
    EXPECT_EQ(Forces(all).size(), Forces(SolveFriction(problem)).size()) << "trial " << trial;
  }
  EXPECT_GT(several, 5);
}

/// The same in space, where solutions are what an iteration comes to from many forces: normal ones
/// projected onto λ_n ≥ 0, tangential ones onto the disc of radius μ λ_n.
TEST(FrictionProblem, NoSolutionIsLeftOutInSpace) {
  RandomProblems random(5);
  std::mt19937 generator(6);
  std::normal_distribution<double> normal;
  int reached = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int n = 1 + trial % 3;
    FrictionProblem problem = random.Draw(n, 2);
    problem.G += 1.0 * Matrix(problem.G.diagonal().asDiagonal());
    for (FrictionContact& contact : problem.contacts) contact.coefficient *= 0.5;
    const std::vector<Vector> found = Forces(SolveFriction(problem));
    const double step = 0.7 / problem.G.norm();
    for (int start = 0; start < 8; ++start) {
      FrictionSolution s;
      s.force.resize(problem.b.size());
      for (double& entry : s.force) entry = 3 * normal(generator);
      for (int k = 0; k < 4000; ++k) {
        s.force -= step * (problem.G * s.force + problem.b);
        for (int i = 0; i < n; ++i) {
          s.force(3 * i) = std::max(s.force(3 * i), 0.0);
          auto tangential = s.force.segment<2>(3 * i + 1);
          const double most = problem.contacts[i].coefficient * s.force(3 * i);
          if (tangential.norm() > most) tangential *= most / tangential.norm();
        }
      }
      if (!(Violation(problem, s) < 1e-8)) continue;
      ++reached;
      double nearest = 1;
      for (const Vector& force : found) nearest = std::min(nearest, (force - s.force).norm());
      EXPECT_LT(nearest, 1e-6) << "trial " << trial;
    }
  }
  EXPECT_GT(reached, 300);
}

/// Directions of slip that are 0.01 rad apart, made by moving b_t across one at which d⊥ · y_t is
/// nearest to zero: both are found. By y_n = (G_nn − μ G_nt · d) λ_n + b_n = 0 for each ψ.
TEST(FrictionProblem, DirectionsThatAreAlikeAreBothFound) {
  RandomProblems random(7);
  int made = 0;
  for (int trial = 0; trial < 1600; ++trial) {
    FrictionProblem problem = random.Draw(1, 2);
    problem.b(0) = -std::abs(problem.b(0));
    const double mu = problem.contacts[0].coefficient;
    struct Slip {
      double across, along, normal;
    };
    const auto at = [&](double psi) {
      const Eigen::Vector2d d(std::cos(psi), std::sin(psi)), left(-d(1), d(0));
      const double normal =
          -problem.b(0) / (problem.G(0, 0) - mu * problem.G.row(0).tail(2).dot(d));
      Vector force(3);
      force << normal, -mu * normal * d;
      const Vector y = problem.G * force + problem.b;
      return Slip{left.dot(y.tail<2>()), d.dot(y.tail<2>()), normal};
    };
    constexpr double kFine = 4e-3, kHalf = 0.005;
    for (double psi = 0; psi < 6.28; psi += kFine) {
      const Slip before = at(psi - kFine), here = at(psi), behind = at(psi + kFine);
      const double bend = (before.across - 2 * here.across + behind.across) / (kFine * kFine);
      const bool turns = (here.across - before.across) * (behind.across - here.across) <= 0;
      if (!turns || !(here.across * bend > 0)) continue;
      if (!(here.normal > 0.1) || !(here.along > 0.1)) continue;
      const Eigen::Vector2d left(-std::sin(psi), std::cos(psi));
      FrictionProblem near = problem;
      near.b.tail<2>() -= (here.across + 0.5 * bend * kHalf * kHalf) * left;
      std::swap(near, problem);
      const bool two = at(psi - 2 * kHalf).across * bend > 0 && at(psi).across * bend < 0 &&
                       at(psi + 2 * kHalf).across * bend > 0;
      std::swap(near, problem);
      if (!two) continue;
      ++made;
      int found = 0;
      for (const FrictionSolution& solution : SolveFriction(near)) {
        if (solution.letters[0] != Letter::kSlip) continue;
        const Eigen::Vector2d d = solution.directions[0];
        if (std::abs(d.dot(left)) < 2 * kHalf && d(0) * left(1) - d(1) * left(0) > 0) ++found;
      }
      EXPECT_EQ(2, found) << "trial " << trial << ", " << psi;
      break;
    }
  }
  EXPECT_GT(made, 15);
}

}  // namespace
}  // namespace contact_flow
