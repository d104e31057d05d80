// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity against the exact size at which the sequence of events changes: the
// estimate is of first order, its relative error vanishes with the margin.
#include "contact_flow/analysis/validity_radius.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using Limit = ValidityRadius::Limit;
constexpr double kGravity = 9.81;

/// The radius of a run from x along w.
ValidityRadius Estimate(const MechanicalSystem& system, const Vector& x, double duration,
                        const Vector& w, const Variables& variables = {}) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const Trajectory run = Simulate(system, x, Vector::Zero(system.num_inputs()), duration, options);
  BDerivativeOptions tight;
  tight.tolerance = 1e-11;
  tight.variables = variables;
  const BDerivative B = DifferentiateOutcome(system, run, tight);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  return ValidityEstimator(system, run, B)(w);
}

class SoftBipedRadius : public testing::Test {
 protected:
  const std::unique_ptr<MechanicalSystem> system = MakeModel("soft_biped");
  const std::vector<std::string>& names = system->description().coordinates;
  const int foot =
      static_cast<int>(std::find(names.begin(), names.end(), "left_foot_z") - names.begin());
};

TEST_F(SoftBipedRadius, EndsWhereTwoTouchdownsChangePlaces) {
  // The feet of a soft biped land at once when they are equally high.
  for (double higher : {1e-2, 1e-3, 1e-4}) {
    Vector x = system->nominal().x;
    x(foot) += higher;
    const Vector w = -Vector::Unit(x.size(), foot);
    const ValidityRadius found = Estimate(*system, x, system->nominal().duration, w);
    EXPECT_EQ(Limit::kEventOrder, found.limit);
    EXPECT_NEAR(higher, found.radius, 10 * higher * higher)
        << Describe(system->description(), found);
  }
}

TEST_F(SoftBipedRadius, IsAFactorOnTheDirectionAndInfiniteForNone) {
  Vector x = system->nominal().x;
  x(foot) += 1e-2;
  const Vector w = -Vector::Unit(x.size(), foot);
  const double one = Estimate(*system, x, 1.4, w).radius;
  EXPECT_NEAR(one / 10, Estimate(*system, x, 1.4, 10 * w).radius, 1e-12);
  const ValidityRadius none = Estimate(*system, x, 1.4, 0 * w);
  EXPECT_EQ(Limit::kNone, none.limit);
  EXPECT_TRUE(std::isinf(none.radius));
}

class CeilingRadius : public testing::Test {
 protected:
  const std::unique_ptr<MechanicalSystem> system = MakeModel("ceiling");  // 1 m high
  const double touching = std::sqrt(2 * kGravity);  // the speed that just reaches it
  ValidityRadius Throw(double speed, double sign, double duration = 0.8) const {
    Vector x(2), w(2);
    x << 0, speed;
    w << 0, sign;
    return Estimate(*system, x, duration, w);
  }
};

TEST_F(CeilingRadius, EndsWhereTheMissedCeilingIsTouched) {
  for (double less : {1e-2, 1e-3, 1e-4}) {
    const ValidityRadius found = Throw(touching - less, 1);
    EXPECT_EQ(Limit::kGap, found.limit);
    EXPECT_EQ(0, found.constraint);
    EXPECT_NEAR(less, found.radius, less * less);
    EXPECT_NEAR((touching - less) / kGravity, found.t, 1e-9);
    EXPECT_NE(Limit::kGap, Throw(touching - less, -1).limit) << "slower, it stays away";
  }
}

TEST_F(CeilingRadius, EndsWhereTheTouchedCeilingIsGrazed) {
  for (double more : {1e-2, 1e-3, 1e-4}) {
    const ValidityRadius found = Throw(touching + more, -1);
    EXPECT_EQ(Limit::kApproachSpeed, found.limit);
    EXPECT_NEAR(more, found.radius, more * more);
  }
}

TEST_F(CeilingRadius, EndsWhereTheTouchdownLeavesTheRun) {
  const double speed = 6, hit = (speed - std::sqrt(speed * speed - 2 * kGravity)) / kGravity;
  // The speed with which the ceiling is hit at t: 1/t + g t/2.
  for (double margin : {1e-3, 1e-4}) {
    const double after = hit + margin, before = hit - margin;
    const ValidityRadius leaves = Throw(speed, -1, after), enters = Throw(speed, 1, before);
    EXPECT_EQ(Limit::kHorizon, leaves.limit);
    EXPECT_EQ(Limit::kHorizon, enters.limit);
    EXPECT_NEAR(speed - (1 / after + kGravity * after / 2), leaves.radius, 2e2 * margin * margin);
    EXPECT_NEAR(1 / before + kGravity * before / 2 - speed, enters.radius, 2e2 * margin * margin);
  }
}

/// λ = load + cos t: at t = π it is load − 1, also to all orders in the load.
TEST(ValidityRadius, EndsWhereAPressedBlockLetsGo) {
  const auto block = test::Make<test::PressedBlock>({{"load", 1.3}});
  Variables variables;
  variables.parameters = ParameterIndices(block.description(), {"load"});
  Vector x(4);
  x << 0, 0, 0, 1;
  const ValidityRadius lighter =
      Estimate(block, x, 4, -Vector::Unit(2 * block.dof() + 1, 2 * block.dof()), variables);
  EXPECT_EQ(Limit::kForce, lighter.limit);
  EXPECT_NEAR(0.3, lighter.radius, 1e-9);
  EXPECT_NEAR(M_PI, lighter.t, 1e-9);
  const ValidityRadius heavier =
      Estimate(block, x, 4, Vector::Unit(2 * block.dof() + 1, 2 * block.dof()), variables);
  EXPECT_EQ(Limit::kNone, heavier.limit);
}

}  // namespace
}  // namespace contact_flow
