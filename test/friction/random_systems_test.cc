// SPDX-License-Identifier: BSD-3-Clause
// Random pairs of coupled tips with friction: laws along their runs, and derivatives beside
// one-sided quotients of other runs.
#include <gtest/gtest.h>

#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

struct Drawn {
  static constexpr double kDuration = 0.6;  // of its runs
  std::unique_ptr<MechanicalSystem> system;
  Vector x;
};

Drawn DrawPair(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Matrix S(4, 4);
  for (double& entry : S.reshaped()) entry = 0.35 * normal(random);
  const Matrix mass = Matrix::Identity(4, 4) + S * S.transpose();
  ParameterValues values;
  for (int i = 0; i < 16; ++i) values["m" + std::to_string(i)] = mass(i / 4, i % 4);
  const double force[] = {2 * normal(random), -9 + normal(random), 2 * normal(random),
                          -9 + normal(random)};
  for (int i = 0; i < 4; ++i) values["f" + std::to_string(i)] = force[i];
  values["stiffness"] = 20 * uniform(random);
  values["damping"] = uniform(random);
  for (int i = 0; i < 2; ++i) {
    values["mu" + std::to_string(i)] = uniform(random) < 0.2 ? -1 : 0.1 + 0.8 * uniform(random);
  }
  Drawn drawn;
  drawn.system = MakeSystem<test::Pair>(values);
  drawn.x.resize(8);
  drawn.x << 0, 0.05 + 0.2 * uniform(random), 0.2, 0.05 + 0.2 * uniform(random),
      1.5 * normal(random), -uniform(random), 1.5 * normal(random), -uniform(random);
  return drawn;
}

TEST(RandomFriction, CoulombsLawHoldsAlongRuns) {
  int arcs = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const Drawn drawn = DrawPair(seed);
    const MechanicalSystem& system = *drawn.system;
    const Trajectory run = Simulate(system, drawn.x, Vector::Zero(0), Drawn::kDuration, Tight());
    if (!run.status.ok()) continue;
    ContactDynamics dynamics(system, Vector::Zero(0));
    for (const Arc& arc : run.arcs) {
      ++arcs;
      for (int k = 0; k <= 8; ++k) {
        const double t = arc.t_begin + (arc.t_end - arc.t_begin) * (k + 0.5) / 9;
        Vector x = arc.x_begin;
        if (arc.t_end > arc.t_begin) arc.dense.Evaluate(t, x.data());
        dynamics.Evaluate(x, arc.mode);
        const Vector force = dynamics.force();
        ConstraintTerms terms;
        system.Constraints(x.head(4), x.tail(4), &terms);
        for (int i = 0; i < 2; ++i) {
          const Friction& friction = system.friction()[i];
          const double normal = force(i), tangential = force(friction.row);
          const double slip = terms.jacobian.row(friction.row).dot(x.tail(4));
          const double size = 1 + force.cwiseAbs().maxCoeff();
          EXPECT_GE(terms.gap(i), -1e-9) << "seed " << seed;
          EXPECT_GE(normal, -1e-7 * size) << "seed " << seed;
          if (std::isfinite(friction.coefficient)) {
            EXPECT_LE(std::abs(tangential), friction.coefficient * normal + 1e-7 * size)
                << "seed " << seed;
          }
          if (arc.mode.LetterOf(i) == Letter::kStick) {
            EXPECT_LT(std::abs(slip), 1e-8) << "seed " << seed;
          } else {
            EXPECT_LE(tangential * slip, 1e-9 * size) << "seed " << seed;
          }
        }
      }
    }
    for (const Transition& t : run.transitions) EXPECT_LE(t.energy_change, 1e-12);
  }
  EXPECT_GT(arcs, 150);
}

/// |Q(α) − B(w)| falls with α, for both signs.
TEST(RandomFriction, DerivativesAreTheLimitsOfQuotients) {
  int confirmed = 0, refused = 0;
  for (unsigned seed = 101; seed <= 160; ++seed) {
    const Drawn drawn = DrawPair(seed);
    const MechanicalSystem& system = *drawn.system;
    const Trajectory run = Simulate(system, drawn.x, Vector::Zero(0), Drawn::kDuration, Tight());
    if (!run.status.ok()) {
      ++refused;
      continue;
    }
    const BDerivative B = DifferentiateOutcome(system, run);
    if (!B.status.ok()) {
      ++refused;
      continue;
    }
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Vector w(8);
    for (double& entry : w) entry = normal(random);
    for (const double sign : {1.0, -1.0}) {
      const Vector prediction = B(sign * w);
      const double size = 1 + prediction.cwiseAbs().maxCoeff();
      double best = 1e300;
      for (const double alpha : {1e-4, 1e-5, 1e-6}) {
        const Trajectory moved =
            Simulate(system, drawn.x + alpha * sign * w, Vector(0), Drawn::kDuration, Tight());
        if (!moved.status.ok()) continue;
        const Vector quotient = (moved.FinalState() - run.FinalState()) / alpha;
        best = std::min(best, (quotient - prediction).cwiseAbs().maxCoeff());
      }
      // At α = 1e-6 the second order is about 1e-6 of curvatures of a few hundred, noise 1e-12/α.
      EXPECT_LT(best, 2e-3 * size) << "seed " << seed << ", sign " << sign;
      ++confirmed;
    }
  }
  EXPECT_GT(confirmed, 80);
  EXPECT_LT(refused, 20);  // cascades of plastic impacts, and jams
}

/// The same from both feet on the floor, at rest and sliding, along directions that keep them there
/// and make them slip, faster than what counts as rest (1e-6 m/s at α = 1e-4 and above).
TEST(RandomFriction, DerivativesOfStartsInContact) {
  int confirmed = 0, refused = 0;
  for (unsigned seed = 301; seed <= 400; ++seed) {
    Drawn drawn = DrawPair(seed);
    const MechanicalSystem& system = *drawn.system;
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    Vector w(8);
    for (double& entry : w) entry = normal(random);
    w(1) = w(3) = w(5) = w(7) = 0;
    for (int i : {0, 1}) {
      drawn.x(1 + 2 * i) = drawn.x(5 + 2 * i) = 0;
      const bool still = std::isinf(system.friction()[i].coefficient) || seed % (i + 2) == 0;
      if (still) drawn.x(4 + 2 * i) = 0;
      if (std::isinf(system.friction()[i].coefficient)) w(4 + 2 * i) = 0;
    }
    Trajectory run;
    try {
      run = Simulate(system, drawn.x, Vector::Zero(0), Drawn::kDuration, Tight());
    } catch (const std::invalid_argument&) {
      ++refused;
      continue;
    }
    const BDerivative B = DifferentiateOutcome(system, run);
    if (!run.status.ok() || !B.status.ok()) {
      ++refused;
      continue;
    }
    for (const double sign : {1.0, -1.0}) {
      Vector prediction;
      try {
        prediction = B(sign * w);
      } catch (const std::logic_error&) {
        ++refused;
        continue;
      }
      double best = 1e300;
      for (const double alpha : {1e-4, 1e-5, 5e-6}) {
        const Trajectory moved =
            Simulate(system, drawn.x + alpha * sign * w, Vector(0), Drawn::kDuration, Tight());
        if (!moved.status.ok()) continue;
        const Vector quotient = (moved.FinalState() - run.FinalState()) / alpha;
        best = std::min(best, (quotient - prediction).cwiseAbs().maxCoeff());
      }
      // Second order is α times curvatures of a few hundred.
      EXPECT_LT(best, 5e-3 * (1 + prediction.cwiseAbs().maxCoeff()))
          << "seed " << seed << ", sign " << sign << ", " << run.arcs.front().mode.Word(2);
      ++confirmed;
    }
  }
  std::printf("%d directions confirmed, %d refused\n", confirmed, refused);
  EXPECT_GT(confirmed, 120);
}

}  // namespace
}  // namespace contact_flow
