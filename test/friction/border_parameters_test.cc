// SPDX-License-Identifier: BSD-3-Clause
// Derivatives by restitution where it is 0, and by friction where it is 0: ends of their ranges.
// A tip of unit mass in the plane (D = 2) or in space, with a constant force.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/tip.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Entries;

struct ParameterDerivative {
  Status status;
  Vector value;
};

/// D by `parameter` of the state after `duration` from x.
template <int D>
ParameterDerivative By(const std::string& parameter, double mu, double up, const Vector& x,
                       double duration) {
  const auto system = MakeSystem<test::Tip<D>>({{"mu0", mu}, {"f" + std::to_string(D - 1), up}});
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  const Trajectory run = Simulate(*system, x, Vector::Zero(0), duration, options);
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions by;
  by.variables.parameters = ParameterIndices(system->description(), {parameter});
  const BDerivative B = DifferentiateOutcome(*system, run, by);
  if (!B.status.ok()) return {B.status, {}};
  return {B.status, B(Vector::Unit(2 * D + 1, 2 * D))};
}

void ExpectNear(const Vector& exact, const ParameterDerivative& by) {
  ASSERT_TRUE(by.status.ok()) << by.status.message;
  EXPECT_LE((by.value - exact).cwiseAbs().maxCoeff(), 1e-8) << by.value.transpose();
}

/// It lands and slides on. With a little restitution ε its bounces are over after 2 ε v/g, and push
/// and rub by as much as resting does meanwhile: the derivative is zero.
TEST(BorderParameters, RestitutionOfAContactThatIsHeld) {
  ExpectNear(Vector::Zero(4), By<2>("gamma0", 0.2, -10, Entries({0, 0.5, 5, 0}), 1));
  ExpectNear(Vector::Zero(4), By<2>("gamma0", 0.2, -10, Entries({0, 0.5, 0.1, 0}), 1));
}

/// It is thrown against the floor by hand and lifted by its force, 10: from the impact at
/// t₁ with speed v on it has ε v more upwards, and μ ε v less along the floor.
TEST(BorderParameters, RestitutionOfAContactThatLeaves) {
  const double speed = std::sqrt(9 - 2 * 10 * 0.1), left = 0.5 - (3 - speed) / 10;
  ExpectNear(Entries({-0.3 * speed * left, speed * left, -0.3 * speed, speed}),
             By<2>("gamma0", 0.3, 10, Entries({0, 0.1, 5, -3}), 0.5));
}

/// It slides at 5 m/s under its weight, 10, for 1 s.
TEST(BorderParameters, FrictionOfAContactThatSlides) {
  ExpectNear(Entries({-5, 0, -10, 0}), By<2>("mu0", 0, -10, Entries({0, 0, 5, 0}), 1));
  ExpectNear(Entries({5, 0, 10, 0}), By<2>("mu0", 0, -10, Entries({0, 0, -5, 0}), 1));
  // Along (3, −4)/5.
  ExpectNear(Entries({-3, 4, 0, -6, 8, 0}), By<3>("mu0", 0, -10, Entries({0, 0, 0, 3, -4, 0}), 1));
}

/// It lands first, at t₁ = √0.1 with the speed 10 t₁: the impulse rubs by 10 t₁ μ, and the rest of
/// the time by 10 (1 − t₁) μ.
TEST(BorderParameters, FrictionOfAContactThatLands) {
  const double left = 1 - std::sqrt(0.1), way = (1 - left) * 10 * left + 5 * left * left;
  ExpectNear(Entries({-way, 0, -10, 0}), By<2>("mu0", 0, -10, Entries({0, 0.5, 5, 0}), 1));
  ExpectNear(Entries({-0.6 * way, 0.8 * way, 0, -6, 8, 0}),
             By<3>("mu0", 0, -10, Entries({0, 0, 0.5, 3, -4, 0}), 1));
}

/// Without slip there is no direction for it.
TEST(BorderParameters, FrictionWithoutSlipIsRefused) {
  for (const double height : {0.0, 0.5}) {
    const ParameterDerivative by = By<2>("mu0", 0, -10, Entries({0, height, 0, 0}), 1);
    EXPECT_EQ(Outcome::kNotDifferentiable, by.status.outcome);
    EXPECT_NE(std::string::npos, by.status.message.find("friction is 0")) << by.status.message;
  }
}

/// On a spring along the floor it swings with ω = 2: it turns back twice and slips at the end as it
/// did at the beginning.
TEST(BorderParameters, FrictionOfASlipThatTurnsIsRefused) {
  const auto system = MakeSystem<test::Tip<2>>({{"mu0", 0}, {"f1", -10}, {"k0", 4}});
  const Trajectory run = Simulate(*system, Entries({0, 0, 1, 0}), Vector::Zero(0), 3);
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_GT(run.FinalState()(2), 0.5);
  BDerivativeOptions by;
  by.variables.parameters = ParameterIndices(system->description(), {"mu0"});
  const BDerivative B = DifferentiateOutcome(*system, run, by);
  EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("friction is 0")) << B.status.message;
}

}  // namespace
}  // namespace contact_flow
