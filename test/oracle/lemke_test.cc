// SPDX-License-Identifier: BSD-3-Clause
// SolveComplementarity against Lemke's method of Siconos on 10⁴ random problems
// 0 ≤ z ⟂ G z + b ≥ 0, n ≤ 10.
#include <gtest/gtest.h>

#include "contact_flow/dynamics/complementarity.h"

#if CONTACT_FLOW_HAVE_SICONOS

#include <LCP_Solvers.h>
#include <LinearComplementarityProblem.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <SolverOptions.h>
#include <lcp_cst.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

namespace contact_flow {
namespace {

constexpr int kProblems = 10000, kLargest = 10;
constexpr unsigned kSeed = 20170419;

/// One problem; where it was made from its solution, that too.
struct Problem {
  std::string kind;
  Matrix G;
  Vector b;
  Vector z;  ///< the solution, or empty
};

/// z by Siconos' Lemke with lexicographic ordering, which degenerate problems do not make cycle.
int Lemke(const Problem& problem, Vector* z) {
  const int n = static_cast<int>(problem.b.size());
  Matrix G = problem.G;  // column-major, as Siconos has it
  Vector b = problem.b, w = Vector::Zero(n);
  *z = Vector::Zero(n);
  LinearComplementarityProblem lcp;
  lcp.size = n;
  lcp.M = NM_create_from_data(NM_DENSE, n, n, G.data());
  lcp.q = b.data();
  SolverOptions* options = solver_options_create(SICONOS_LCP_LEMKE);
  int info = -1;
  lcp_lexicolemke(&lcp, z->data(), w.data(), &info, options);
  solver_options_delete(options);
  std::free(options);
  lcp.M->matrix0 = nullptr;  // it is ours
  NM_clear(lcp.M);
  std::free(lcp.M);
  return info;
}

class Problems {
 public:
  /// The next problem; four kinds in turn, n = 1 … 10.
  Problem Next() {
    const int kind = count_ % 4, n = 1 + count_ / 4 % kLargest;
    ++count_;
    Problem problem;
    problem.b = Normal(n, 1);
    switch (kind) {
      case 0: {
        problem.kind = "diagonal";
        const Vector exponents = Normal(n, 1);
        problem.G = exponents.array().exp().matrix().asDiagonal();
        break;
      }
      case 1: {
        problem.kind = "dense";
        const Matrix A = Normal(n, n + 2);
        problem.G = A * A.transpose();
        break;
      }
      case 2:
        problem.kind = "ill-conditioned";
        problem.G = WithCondition(n, 1e6);
        break;
      default:
        // Strict complementarity fails: about a third of the i has z_i = w_i = 0.
        problem.kind = "degenerate";
        problem.G = WithCondition(n, 10);
        problem.z = Vector::Zero(n);
        problem.b.setZero();
        for (int i = 0; i < n; ++i) {
          const double value = std::abs(normal_(generator_));
          const int which = static_cast<int>(generator_() % 3);
          (which == 0 ? problem.z : problem.b)(i) = which == 2 ? 0 : value;
        }
        problem.b -= problem.G * problem.z;
    }
    return problem;
  }

 private:
  Matrix Normal(int rows, int cols) {
    Matrix A(rows, cols);
    for (int j = 0; j < cols; ++j) {
      for (int i = 0; i < rows; ++i) A(i, j) = normal_(generator_);
    }
    return A;
  }
  /// A random rotation of a diagonal matrix with entries from 1 down to 1/condition.
  Matrix WithCondition(int n, double condition) {
    const Matrix A = Normal(n, n);
    const Matrix Q = Eigen::HouseholderQR<Matrix>(A).householderQ();
    Vector eigenvalues(n);
    for (int i = 0; i < n; ++i) eigenvalues(i) = std::pow(condition, n > 1 ? -i / (n - 1.0) : 0.0);
    const Matrix G = Q * eigenvalues.asDiagonal() * Q.transpose();
    return (G + G.transpose()) / 2;
  }

  std::mt19937 generator_{kSeed};
  std::normal_distribution<double> normal_;
  int count_ = 0;
};

TEST(SiconosLemke, AgreesOnTenThousandRandomProblems) {
  Problems problems;
  double worst = 0;  // difference over tolerance
  int pushing = 0, vanishing = 0;
  for (int trial = 0; trial < kProblems; ++trial) {
    const Problem problem = problems.Next();
    SCOPED_TRACE(problem.kind + ", trial " + std::to_string(trial) + ", seed " +
                 std::to_string(kSeed));
    const auto found = SolveComplementarity(problem.G, problem.b);
    ASSERT_TRUE(found);
    const ComplementaritySolution& ours = *found;
    Vector lemke;
    ASSERT_EQ(0, Lemke(problem, &lemke)) << "Lemke's method found no solution";
    // A perturbation r of b moves z by at most |r|/μ, μ the smallest eigenvalue of G (monotonicity:
    // μ|δz|² ≤ δzᵀG δz ≤ −δzᵀδb). Backward errors of the solvers: 1e-13·max|b| by which signs are
    // judged, in each of n entries, and the rounding of n pivots on G, below n·ε·|G||z| each:
    // 10·10·2.2e-16 = 2.2e-14.
    const Vector eigenvalues = Eigen::SelfAdjointEigenSolver<Matrix>(problem.G).eigenvalues();
    const double n = static_cast<double>(problem.b.size());
    const double residual = 1e-13 * std::sqrt(n) * problem.b.cwiseAbs().maxCoeff() +
                            3e-14 * eigenvalues(eigenvalues.size() - 1) * ours.z.norm();
    const double tolerance = 2 * residual / eigenvalues(0);
    worst = std::max(worst, (ours.z - lemke).norm() / tolerance);
    ASSERT_LE((ours.z - lemke).norm(), tolerance) << ours.z.transpose() << '\n'
                                                  << lemke.transpose();
    if (problem.z.size() > 0) {
      ASSERT_LE((ours.z - problem.z).norm(), tolerance);
    }
    ours.z.maxCoeff() > 0 ? ++pushing : ++vanishing;
  }
  EXPECT_GT(pushing, kProblems / 2);
  EXPECT_GT(vanishing, 100) << "problems with the solution 0 are met, too";
  std::cout << "seed " << kSeed << ": largest difference is " << worst << " of what is allowed\n";
}

}  // namespace
}  // namespace contact_flow

#else

TEST(SiconosLemke, AgreesOnTenThousandRandomProblems) {
  GTEST_SKIP() << "built without Siconos (libsiconos-numerics-dev)";
}

#endif
