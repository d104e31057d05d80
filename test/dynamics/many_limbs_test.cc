// SPDX-License-Identifier: BSD-3-Clause
// Machines of many limbs, whose M is mostly zeros: what is computed by its sparse factor, against
// dense algebra and difference quotients.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/impact_reset.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/mass_factor.h"
#include "src/dynamics/mode_selection.h"
#include "test/model/growing_robots.h"

namespace contact_flow {
namespace {

constexpr int kLegs = 12;

Vector Mixture(Eigen::Index size, double phase) {
  Vector w(size);
  for (Eigen::Index i = 0; i < size; ++i) w(i) = std::sin(phase + 1.7 * static_cast<double>(i * i));
  return w;
}

/// The table of legs, turned and in motion: no number is zero but by structure.
struct ManyLimbs : testing::Test {
  ManyLimbs() : system(MakeRobot(Legs(kLegs))), x(system->nominal().x) {
    x += 0.2 * Mixture(x.size(), 1);
    v = x.tail(system->dof());
    q = x.head(system->num_positions());
  }
  std::unique_ptr<RobotSystem> system;
  Vector x, q, v;
};

TEST_F(ManyLimbs, TheFactorSolvesAsTheDenseOne) {
  Matrix mass;
  Vector force;
  system->Dynamics(q, v, system->nominal().u, ContactMode(), &mass, &force);
  MassFactor factor;
  factor.Compute(mass);
  ASSERT_TRUE(factor.sparse());
  ASSERT_TRUE(factor.regular());
  const Matrix inverse = factor.Solved(Matrix::Identity(system->dof(), system->dof()));
  const Matrix dense = mass.llt().solve(Matrix::Identity(system->dof(), system->dof()));
  // Either is off by about ε cond(M), of masses 0.001 to 12: 1e5 ε.
  EXPECT_LT((inverse - dense).cwiseAbs().maxCoeff(), 1e-9 * dense.cwiseAbs().maxCoeff());
  Vector half = force;
  factor.SolveL(half);
  EXPECT_NEAR(force.dot(dense * force), half.squaredNorm(), 1e-9 * half.squaredNorm());
}

/// Rows of one column that do not meet in M, as zeros by chance do, meet in its factor.
TEST(MassFactors, FillIn) {
  Matrix A = 20 * Matrix::Identity(40, 40);
  const int pairs[][2] = {{39, 5}, {39, 0}, {38, 5}, {38, 1}, {30, 7}, {30, 2}, {7, 4}, {21, 20}};
  for (const auto& [i, j] : pairs) A(i, j) = A(j, i) = 3 + 0.1 * i;
  MassFactor factor;
  factor.Compute(A);
  ASSERT_TRUE(factor.sparse());
  ASSERT_TRUE(factor.regular());  // diagonally dominant
  const Vector b = Mixture(40, 2);
  EXPECT_LT((A * factor.Solved(b) - b).cwiseAbs().maxCoeff(), 1e-14);
}

/// One factor, as a run has it: other numbers, other zeros, none, other sizes, and back.
TEST(MassFactors, FollowZerosThatChange) {
  const auto with = [](int d, std::vector<std::pair<int, int>> pairs) {
    Matrix A = 20 * Matrix::Identity(d, d);
    for (const auto& [i, j] : pairs) A(i, j) = A(j, i) = 3 + 0.1 * i;
    return A;
  };
  const Matrix some = with(40, {{39, 5}, {30, 7}, {7, 4}}), more = with(40, {{39, 5}, {38, 6}});
  const Matrix full = some + Matrix::Constant(40, 40, 0.1), small = with(20, {{19, 3}});
  MassFactor factor;
  int step = 0;
  for (const Matrix& A :
       {some, Matrix(2 * some), more, full, Matrix(2 * full), some, small, more}) {
    factor.Compute(A);
    EXPECT_EQ((A.array() != 0).count() < A.size(), factor.sparse()) << step;
    const Vector b = Mixture(A.rows(), 2);
    EXPECT_LT((A * factor.Solved(b) - b).cwiseAbs().maxCoeff(), 1e-13) << step;
    ++step;
  }
}

TEST(MassFactors, AreDenseWhereMIs) {
  const Matrix A = Matrix::Identity(30, 30) + Matrix::Constant(30, 30, 0.1);
  MassFactor factor;
  factor.Compute(A);
  EXPECT_FALSE(factor.sparse());
  EXPECT_LT((factor.Solved(A) - Matrix::Identity(30, 30)).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(MassFactors, TellAnIndefiniteMass) {
  Matrix A = Matrix::Identity(30, 30);
  A(3, 17) = A(17, 3) = 2;
  MassFactor factor;
  factor.Compute(A);
  EXPECT_TRUE(factor.sparse());
  EXPECT_FALSE(factor.regular());
}

/// (1a) itself, of which v̇ and λ are the solution.
TEST_F(ManyLimbs, TheMotionSolvesTheEquations) {
  ContactDynamics dynamics(*system, system->nominal().u);
  const ContactMode mode({0, 2, 3, 7, 11});
  dynamics.Evaluate(x, mode);
  Matrix mass;
  Vector force;
  system->Dynamics(q, v, system->nominal().u, mode, &mass, &force);
  ConstraintTerms terms;
  system->Constraints(q, v, &terms);
  const Vector momentum =
      mass * dynamics.acceleration() - force - terms.jacobian.transpose() * dynamics.force();
  EXPECT_LT(momentum.cwiseAbs().maxCoeff(), 1e-10 * force.cwiseAbs().maxCoeff());
  for (int i : mode) {
    EXPECT_NEAR(0, terms.jacobian.row(i).dot(dynamics.acceleration()) + terms.bias(i),
                1e-10 * dynamics.acceleration().cwiseAbs().maxCoeff());
  }
}

/// Central differences along the motion, of error h² and ε/h: 1e-8 of the rate's terms.
TEST_F(ManyLimbs, RatesOfForcesAreThoseOfDifferences) {
  ContactDynamics dynamics(*system, system->nominal().u);
  const ContactMode mode({0, 2, 3, 7, 11});
  const Vector rate = dynamics.ForceRates(x, mode);
  Vector tangent(2 * system->dof());
  tangent << v, dynamics.acceleration();
  const Vector whole = dynamics.ForceRate(x, mode);
  const double h = 1e-5;
  dynamics.Evaluate(system->Perturb(x, h * tangent), mode);
  Vector difference = dynamics.force();
  dynamics.Evaluate(system->Perturb(x, -h * tangent), mode);
  difference = (difference - dynamics.force()) / (2 * h);
  const double size = difference.cwiseAbs().maxCoeff();
  EXPECT_GT(size, 1);
  EXPECT_LT((rate - difference).cwiseAbs().maxCoeff(), 1e-6 * size);
  EXPECT_LT((rate - whole).cwiseAbs().maxCoeff(), 1e-10 * size);
}

/// The product with a direction against the matrix of the dense way, of feet that bounce or stay.
TEST_F(ManyLimbs, ResetsAreTheirJacobians) {
  system = MakeRobot(Legs(kLegs, 0.3));
  const ConstraintSet touching({1, 4, 5, 9});
  const ImpactResult impact = SolveImpact(*system, q, v, touching, ImpactLaw::kProjection);
  const auto inertia = std::make_shared<const InverseInertia>(*system, q, v);
  ASSERT_TRUE(ImpactReset::Terms::Allowed(*system, *inertia, Variables()));
  ResidualJacobian before, after;
  system->DifferentiateImpact(q, impact.v_plus - v, impact.impulse, impact.v_plus, &after);
  system->DifferentiateImpact(q, impact.v_plus - v, impact.impulse, v, &before);
  const auto terms = std::make_shared<const ImpactReset::Terms>(ImpactReset::Terms{
      *system, inertia, SparseRows(after.momentum_q), SparseRows(after.constraint_q),
      SparseRows(before.constraint_q), 2 * system->dof()});
  for (const ConstraintSet persisting : {ConstraintSet(), ConstraintSet({4, 5})}) {
    const Matrix dense = ImpactJacobian(*system, *inertia, q, v, impact, touching, persisting);
    const ImpactReset reset(terms, touching, persisting);
    const double size = dense.cwiseAbs().maxCoeff();
    EXPECT_LT((reset.matrix() - dense).cwiseAbs().maxCoeff(), 1e-9 * size);
    const Vector w = Mixture(2 * system->dof(), 3);
    EXPECT_LT((reset * w - dense * w).cwiseAbs().maxCoeff(), 1e-9 * size);
    const int d = system->dof();
    EXPECT_LT((reset.ByConfiguration(d) - dense.block(d, 0, d, d)).cwiseAbs().maxCoeff(),
              1e-9 * size);
  }
}

/// λ ≥ 0 where a contact holds, ä ≥ 0 where not: with this, G being definite, there is one choice.
TEST_F(ManyLimbs, ChosenContactsPushAndOthersOpen) {
  ContactDynamics dynamics(*system, system->nominal().u);
  const ConstraintSet all = ConstraintSet::All(kLegs);
  int clear = 0;
  for (int k = 0; k < 20; ++k) {
    Vector y = system->nominal().x;
    y += (k < 10 ? 0.01 : 0.2) * Mixture(y.size(), k);
    if (k < 10) y.head(system->num_positions()).tail(2 * kLegs).setConstant(0.1);  // pressed
    dynamics.Evaluate(y, ContactMode());
    clear += dynamics.PushClearly(y, all, ConstraintSet());
    const ContactMode mode = SelectContactMode(&dynamics, y, all, {});
    dynamics.Evaluate(y, mode);
    ConstraintTerms terms;
    system->Constraints(y.head(system->num_positions()), y.tail(system->dof()), &terms);
    const Vector opening = terms.jacobian * dynamics.acceleration() + terms.bias;
    const double size = dynamics.acceleration().cwiseAbs().maxCoeff();
    for (int i : mode) EXPECT_GE(dynamics.force()(i), 0);
    for (int i : all - mode) EXPECT_GE(opening(i), -1e-12 * size);
  }
  EXPECT_GE(clear, 10);
  EXPECT_LT(clear, 20);
}

}  // namespace
}  // namespace contact_flow
