// SPDX-License-Identifier: BSD-3-Clause
// Slip that begins in space. A mass on a floor is pulled by a force that grows and turns:
//   s' = k (ρ u − s/|s|),  ρ = 1 + 0.8 t,  u at the angle 0.9 t + 0.3,  k = 1.3 = μ g,
// sticks up to t = 0 and slips from there on.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/friction/systems/contact_parameters.h"
#include "test/friction/systems/tip.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kForce = 1.3, kGrowth = 0.8, kTurn = 0.9;

struct Tug {
  static constexpr const char* kName = "tug";
  static constexpr const char* kSummary = "a mass on a floor, pulled";
  static constexpr int kDof = 4, kConstraints = 1, kInputs = 2, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 4> kCoordinates = {"x", "y", "z", "clock"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 2> kInputNames = {"pull_x", "pull_y"};
  template <class P>
  using Parameters = test::ContactParameters<P>;
  template <class S>
  using V = Eigen::Matrix<S, 4, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const V<S>&, Eigen::Matrix<S, 4, 4>* M) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(i == j ? 1.0 : 0.0);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const V<S>& q, const V<S>&,
                    const Eigen::Matrix<S, 2, 1>& u, V<S>* f) {
    using std::cos;
    using std::sin;
    const S size = kForce * (kGrowth * q(3) + 1.0), angle = kTurn * q(3) + 0.3;
    (*f)(0) = size * cos(angle) + u(0);
    (*f)(1) = size * sin(angle) + u(1);
    (*f)(2) = S(-kGravity);
    (*f)(3) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const V<S>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const V<S>&, const V<S>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>&, int) {
    return P(kForce / kGravity);
  }
  template <class P>
  static P Restitution(const Parameters<P>&, int) {
    return P(0.0);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(8);
    run.x(3) = -0.1;
    run.x(7) = 1;
    run.u = Vector::Zero(2);
    return run;
  }
};

/// The slip at t = 0.7 is that of an independent integration from the slow manifold on: classical
/// Runge–Kutta from 1e-3 and from 2.5e-4 s after the onset, steps of a quarter of |s|/k, agree to
/// its twelve digits. Thousands of short steps add their errors up: some hundred tolerances, and
/// ten of the speed that the onset adds.
TEST(SlipOnset, OfAForceThatGrowsAndTurns) {
  const auto system = MakeSystem<Tug>({});
  for (const double tolerance : {1e-9, 1e-10, 1e-11}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    const Trajectory run = Simulate(*system, system->nominal().x, Vector::Zero(2), 0.8, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.arcs.size());
    EXPECT_EQ("s", run.arcs[0].mode.Word(1));
    EXPECT_EQ("l", run.arcs[1].mode.Word(1));
    EXPECT_NEAR(0.1, run.transitions[0].t, 10 * tolerance);
    EXPECT_NEAR(0.168952261326, run.FinalState()(4), 300 * tolerance);
    EXPECT_NEAR(0.189065895195, run.FinalState()(5), 300 * tolerance);
  }
}

/// The clock stands still, and the pull jumps from within the cone to F, beyond it: the mass goes
/// along F by (|F| − k) τ²/2 in the time τ from there on.
TEST(SlipOnset, OfAnInputThatJumps) {
  const std::shared_ptr<const MechanicalSystem> system = MakeSystem<Tug>({});
  Vector x = system->nominal().x;
  x(7) = 0;
  const double base = kForce * (1 - 0.1 * kGrowth), angle = 0.3 - 0.1 * kTurn, tau = 0.4;
  const Eigen::Vector2d pull(-2.5, 0.7);
  const Eigen::Vector2d F = base * Eigen::Vector2d(std::cos(angle), std::sin(angle)) + pull;
  const Eigen::Vector2d way = (F.norm() - kForce) * tau * tau / 2 * F.normalized();
  const InputSchedule both{{0, 0.3}, {Vector::Zero(2), Vector(pull)}};
  const Trajectory run = Simulate(*system, x, both, 0.3 + tau);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("s", run.arcs[0].mode.Word(1));
  EXPECT_EQ("l", run.arcs[1].mode.Word(1));
  EXPECT_LT((run.FinalState().head<2>() - way).norm(), 1e-7);
  // s = (|F| − k) τ F/|F| changes by τ (F̂F̂ᵀ + (1 − k/|F|)(I − F̂F̂ᵀ)) for each unit of pull.
  BDerivativeOptions by_pull;
  by_pull.variables.inputs = true;
  const BDerivative B = DifferentiateOutcome(*system, run, by_pull);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Eigen::Matrix2d along = F * F.transpose() / F.squaredNorm();
  const Eigen::Matrix2d exact =
      tau * (along + (1 - kForce / F.norm()) * (Eigen::Matrix2d::Identity() - along));
  for (int k = 0; k < 2; ++k) {
    const Vector derivative = B(Vector::Unit(10, 8 + k));
    EXPECT_LT((derivative.segment<2>(4) - exact.col(k)).norm(), 1e-6) << k;
    EXPECT_LT((derivative.head<2>() - tau / 2 * exact.col(k)).norm(), 1e-6) << k;
  }
  OnlineFlow online(system, 0, x, Vector::Zero(2), {});
  online.SetInput(0.3, pull);
  while (online.now() < 0.3 + tau && online.status().ok()) online.AdvanceTo(0.3 + tau);
  ASSERT_TRUE(online.status().ok()) << online.status().message;
  EXPECT_LT((run.FinalState() - online.State()).norm(), 1e-9);
}

/// s and the way x at time T after s' = F(t) − k s/|s| from rest, F(t) being the mass's force and a
/// pull: classical Runge–Kutta from the slow manifold, 5e-4 s after the onset, where s follows F.
struct Tugged {
  Eigen::Vector2d s, x;
};

Tugged Integrate(const Eigen::Vector2d& pull, double friction, double duration) {
  const auto force = [&](double t) {
    const double size = kForce * (1 + kGrowth * t), angle = kTurn * t + 0.3;
    return Eigen::Vector2d(size * Eigen::Vector2d(std::cos(angle), std::sin(angle)) + pull);
  };
  double low = -0.2, high = 0.2;  // the onset: |F| = friction
  for (int k = 0; k < 100; ++k) {
    const double middle = 0.5 * (low + high);
    (force(middle).norm() < friction ? low : high) = middle;
  }
  const double first = 5e-4, h = 1e-6;
  const double grows = (force(low + h).norm() - force(low - h).norm()) / (2 * h);
  double t = low + first;
  Tugged at;
  // |s| = f' τ²/2, f = |F|, along the force but for O(τ²): |s| d' = F − (F·d) d.
  at.s = grows * first * first / 2 * force(t).normalized();
  at.x = at.s * first / 3;
  const auto rate = [&](double time, const Eigen::Vector2d& s) {
    return Eigen::Vector2d(force(time) - friction * s.normalized());
  };
  while (t < duration) {
    const double step = std::min({0.25 * at.s.norm() / friction, 2e-4, duration - t});
    const Eigen::Vector2d k1 = rate(t, at.s), s2 = at.s + step / 2 * k1;
    const Eigen::Vector2d k2 = rate(t + step / 2, s2), s3 = at.s + step / 2 * k2;
    const Eigen::Vector2d k3 = rate(t + step / 2, s3), s4 = at.s + step * k3;
    const Eigen::Vector2d k4 = rate(t + step, s4);
    at.x += step / 6 * (at.s + 2 * s2 + 2 * s3 + s4);
    at.s += step / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    t += step;
  }
  return at;
}

/// Where nothing but slip begins the event is the identity (friction, 4.1): the derivative by a
/// constant pull and by friction beside central quotients of another integration.
TEST(SlipOnset, HasTheDerivativeOfItsForces) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const auto system = MakeSystem<Tug>({});
  for (const double tolerance : {1e-9, 1e-11}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    const Trajectory run = Simulate(*system, system->nominal().x, Vector::Zero(2), 0.8, options);
    BDerivativeOptions by_pull;
    by_pull.variables.inputs = true;
    const BDerivative B = DifferentiateOutcome(*system, run, by_pull);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_EQ(1u, B.Pieces().pieces().size());
    for (int k = 0; k < 2; ++k) {
      const double step = 1e-4;
      Eigen::Vector2d pull = Eigen::Vector2d::Zero();
      pull(k) = step;
      const Tugged up = Integrate(pull, kForce, 0.7), down = Integrate(-pull, kForce, 0.7);
      Vector w = Vector::Zero(10);
      w(8 + k) = 1;
      const Vector derivative = B(w);
      EXPECT_LT((derivative.segment<2>(4) - (up.s - down.s) / (2 * step)).norm(), 2e-6) << k;
      EXPECT_LT((derivative.segment<2>(0) - (up.x - down.x) / (2 * step)).norm(), 2e-6) << k;
    }
  }
}

/// Behind the onset a turn of the slip decays at the rate k/|s|, which is 1e12/s at first and falls
/// with 1/τ²: steps that followed it would be as many.
TEST(SlipOnset, HasTangentsOfFewSteps) {
  const auto system = MakeSystem<Tug>({});
  const SimulateOptions options = test::AtTolerance(1e-12);
  const Trajectory run = Simulate(*system, system->nominal().x, Vector::Zero(2), 0.8, options);
  ASSERT_EQ(2u, run.arcs.size());
  ContactDynamics dynamics(*system, Vector::Zero(2));
  VariationStatistics statistics;
  PropagateArc(&dynamics, run.arcs.back(), 1e-12, &statistics);
  EXPECT_LT(statistics.steps + statistics.rejected_steps, 1000);
}

/// One motion in other units of time, T seconds. A point falls, lands vertically at T √0.02, and
/// slips from there on along (9, 3), by |(9, 3)| − 2 = |s'| T².
TEST(SlipOnset, IsTheSameInOtherUnits) {
  const double landing = std::sqrt(0.02), duration = 0.5, after = duration - landing;
  const double pull = std::hypot(9.0, 3.0), way = 0.5 * (pull - 2) * after * after / pull;
  for (const double T : {1e2, 1.0, 1e-2, 1e-3, 1e-4}) {
    const auto system = MakeSystem<test::Tip<3>>(
        {{"mu0", 0.2}, {"f0", 9 / T / T}, {"f1", 3 / T / T}, {"f2", -10 / T / T}});
    Vector x(6);
    x << 0, 0, 0.1, -9 * landing / T, -3 * landing / T, 0;
    const double back = 0.5 * landing * landing;
    for (const double tolerance : {1e-9, 1e-12}) {
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      const Trajectory run = Simulate(*system, x, Vector::Zero(0), duration * T, options);
      ASSERT_TRUE(run.status.ok()) << T << " " << tolerance << ": " << run.status.message;
      EXPECT_EQ("l", run.arcs.back().mode.Word(1));
      // An onset of ten tolerances, or of what 1e-12 units of time gain, 1e-11/T², for 0.36 T; the
      // rest is that of many short steps.
      const double error = 300 * (tolerance * std::max(1.0, T) + 1e-11 / T);
      EXPECT_NEAR(9 * (way - back), run.FinalState()(0), error) << T << " " << tolerance;
      EXPECT_NEAR(3 * (way - back), run.FinalState()(1), error) << T << " " << tolerance;
    }
  }
}

}  // namespace
}  // namespace contact_flow
