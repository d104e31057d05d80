// SPDX-License-Identifier: BSD-3-Clause
// SolveFriction against the solvers of Siconos on random problems with Coulomb friction, in the
// plane (fc2d: Lemke's method, Gauss-Seidel, enumeration) and in space (fc3d: a nonsmooth Newton
// method, Gauss-Seidel). The first that solves a problem counts.
// CONTACT_FLOW_FRICTION_PROBLEMS=5000 draws that many of each.
#include <gtest/gtest.h>

#include "contact_flow/dynamics/friction_problem.h"

#if CONTACT_FLOW_HAVE_SICONOS

#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <SolverOptions.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <random>
#include <string>

#include "test/environment.h"

namespace contact_flow {
namespace {

/// Of each dimension.
const int kFrictionProblems =
    static_cast<int>(test::FromEnvironment("CONTACT_FLOW_FRICTION_PROBLEMS", 1000));
constexpr unsigned kFrictionSeed = 20180711;

/// G = A Aᵀ of a random A, rows (normal, tangential) contact by contact; half of the problems with
/// rows that are short in one direction.
FrictionProblem Draw(int dimension, int most_contacts, std::mt19937* generator) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int contacts = 1 + static_cast<int>(uniform(*generator) * most_contacts);
  const int n = contacts * (1 + dimension);
  const auto draw = [&](int rows, int cols) {
    Matrix A(rows, cols);
    for (double& entry : A.reshaped()) entry = normal(*generator);
    return A;
  };
  Matrix A = draw(n, n + 3);
  if (uniform(*generator) < 0.5) A.col(0) *= 0.1;
  FrictionProblem problem;
  problem.G = A * A.transpose() / n;
  problem.b = draw(n, 1);
  for (int k = 0; k < contacts; ++k) problem.b(k * (1 + dimension)) -= 0.5;
  for (int k = 0; k < contacts; ++k) {
    FrictionContact contact;
    contact.coefficient = 1.5 * uniform(*generator);
    contact.dimension = dimension;
    problem.contacts.push_back(contact);
  }
  return problem;
}

/// How far forces are from the laws, by the natural map of de Saxce and Feng: r = P_K(r − û), K the
/// cones and û = u + μ |u_t| e_n; relative to |b|.
double Error(const FrictionProblem& problem, const Vector& force) {
  const Vector result = problem.G * force + problem.b;
  Vector off(force.size());
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int row = problem.Row(k), d = problem.contacts[k].dimension;
    const double mu = problem.contacts[k].coefficient;
    const double normal = force(row) - result(row) - mu * result.segment(row + 1, d).norm();
    const Vector along = (force - result).segment(row + 1, d);
    const double size = along.norm();
    const double inside = (normal + mu * size) / (1 + mu * mu);  // of the nearest on the cone
    off(row) = normal;
    off.segment(row + 1, d) = along;
    if (size <= mu * normal) continue;
    off(row) = std::max(inside, 0.0);
    off.segment(row + 1, d) *= mu * off(row) / size;
  }
  return (off - force).norm() / problem.b.norm();
}

/// A problem as Siconos has it.
class Theirs {
 public:
  explicit Theirs(const FrictionProblem& problem)
      : given_(problem),
        n_(static_cast<int>(problem.b.size())),
        plane_(problem.contacts.front().dimension == 1),
        G_(problem.G),
        b_(problem.b) {
    for (const FrictionContact& contact : problem.contacts) mu_.push_back(contact.coefficient);
    problem_.dimension = plane_ ? 2 : 3;
    problem_.numberOfContacts = static_cast<int>(mu_.size());
    problem_.M = NM_create_from_data(NM_DENSE, n_, n_, G_.data());
    problem_.q = b_.data();
    problem_.mu = mu_.data();
  }
  ~Theirs() {
    problem_.M->matrix0 = nullptr;  // it is ours
    NM_clear(problem_.M);
    std::free(problem_.M);
  }
  Theirs(const Theirs&) = delete;
  Theirs& operator=(const Theirs&) = delete;

  /// Their forces, or none where no method of theirs converges.
  Vector Solve() {
    const std::vector<int> methods =
        plane_ ? std::vector<int>{SICONOS_FRICTION_2D_LEMKE, SICONOS_FRICTION_2D_NSGS,
                                  SICONOS_FRICTION_2D_ENUM}
               : std::vector<int>{SICONOS_FRICTION_3D_NSN_AC, SICONOS_FRICTION_3D_NSGS};
    for (int method : methods) {
      const Vector force = By(method);
      if (force.size() > 0) return force;
    }
    return {};
  }

 private:
  Vector By(int method) {
    SolverOptions* options = solver_options_create(method);
    options->dparam[SICONOS_DPARAM_TOL] = 1e-13;
    options->iparam[SICONOS_IPARAM_MAX_ITER] = method == SICONOS_FRICTION_3D_NSGS ? 20000 : 500;
    Vector force = Vector::Zero(n_), result = Vector::Zero(n_);
    const int info = plane_ ? fc2d_driver(&problem_, force.data(), result.data(), options)
                            : fc3d_driver(&problem_, force.data(), result.data(), options);
    solver_options_delete(options);
    std::free(options);
    const bool solved = info == 0 && force.allFinite() && Error(given_, force) <= 1e-9;
    return solved ? force : Vector();
  }

  const FrictionProblem& given_;
  const int n_;
  const bool plane_;
  Matrix G_;  // column-major, as Siconos has it
  Vector b_;
  std::vector<double> mu_;
  FrictionContactProblem problem_{};
};

/// Every solution of ours satisfies their laws, and theirs is one of ours.
void Compare(int dimension, int most_contacts) {
  std::mt19937 generator(kFrictionSeed);
  int undecided = 0, several = 0, sticking = 0, slipping = 0, open = 0;
  double worst = 0, apart = 0;
  for (int trial = 0; trial < kFrictionProblems; ++trial) {
    SCOPED_TRACE("trial " + std::to_string(trial) + ", seed " + std::to_string(kFrictionSeed));
    const FrictionProblem problem = Draw(dimension, most_contacts, &generator);
    const std::vector<FrictionSolution> ours = SolveFriction(problem);
    Theirs theirs(problem);
    for (const FrictionSolution& solution : ours) {
      worst = std::max(worst, Error(problem, solution.force));
      for (Letter letter : solution.letters) {
        (letter == Letter::kOpen ? open : letter == Letter::kStick ? sticking : slipping) += 1;
      }
    }
    several += ours.size() > 1;
    const Vector force = theirs.Solve();
    if (force.size() == 0) {
      ++undecided;
      continue;
    }
    ASSERT_FALSE(ours.empty()) << "theirs are " << force.transpose();
    double nearest = std::numeric_limits<double>::infinity();
    for (const FrictionSolution& solution : ours) {
      nearest = std::min(nearest, (problem.G * (solution.force - force)).norm());
    }
    ASSERT_LE(nearest, 1e-7 * problem.b.norm()) << "theirs are " << force.transpose();
    apart = std::max(apart, nearest / problem.b.norm());
  }
  EXPECT_LE(worst, 1e-9);
  EXPECT_LE(undecided, kFrictionProblems / 50);
  EXPECT_GT(std::min({sticking, slipping, open}), kFrictionProblems / 5);
  std::cout << kFrictionProblems << " problems: " << undecided << " not decided by theirs, "
            << several << " with several solutions; errors of ours " << worst << ", apart " << apart
            << '\n';
}

TEST(SiconosCoulomb, AgreesInThePlane) { Compare(1, 4); }
TEST(SiconosCoulomb, AgreesInSpace) { Compare(2, 3); }

}  // namespace
}  // namespace contact_flow

#else

TEST(SiconosCoulomb, AgreesInThePlane) {
  GTEST_SKIP() << "built without Siconos (libsiconos-numerics-dev)";
}
TEST(SiconosCoulomb, AgreesInSpace) {
  GTEST_SKIP() << "built without Siconos (libsiconos-numerics-dev)";
}

#endif
