// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity against the exact size at which the sequence of events changes: the
// estimate is of first order, its relative error vanishes with the margin.
#include "contact_flow/analysis/validity_radius.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::kGravity;

using Limit = ValidityRadius::Limit;

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

/// Two heights over floors, M = [[1, m], [m, 1]]: one rests while the other one falls on its floor.
struct Coupled : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "coupled";
  static constexpr std::array<const char*, 2> kCoordinates = {"held", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"held_floor", "floor"};
  template <class P>
  struct Parameters {
    P coupling = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(coupling, "coupling", "kg", "m", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                         Eigen::Matrix<S, 2, 2>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(0, 1) = (*M)(1, 0) = S(p.coupling);
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(-3.0);
    (*f)(1) = S(-kGravity);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1);
  }
};

/// p = −M v⁻ = s (m, 1) for the speed s of the fall: the impulse on the contact that rests pushes
/// for m > 0, at 0 it vanishes, and below the impact lifts it, by −m s.
TEST(ValidityRadius, EndsWhereAnImpactLiftsAContactThatRests) {
  Vector x(4);
  x << 0, 0.1, 0, 0;
  Variables variables;
  variables.parameters = {0};
  const Vector more = Vector::Unit(5, 4);
  for (double m : {0.1, 0.01}) {
    const auto pressed = test::Make<Coupled>({{"coupling", m}});
    const ValidityRadius lifted = Estimate(pressed, x, 0.3, -more, variables);
    EXPECT_EQ(Limit::kImpulse, lifted.limit) << Describe(pressed.description(), lifted);
    EXPECT_EQ(0, lifted.constraint);
    EXPECT_NEAR(m, lifted.radius, 1e-9);
    // The other way round; the run ends on its way up, before it has bounced to rest.
    const auto flying = test::Make<Coupled>({{"coupling", -m}});
    const double impact = std::sqrt(0.2 / kGravity);
    const ValidityRadius stays = Estimate(flying, x, impact + 0.3 * m, more, variables);
    EXPECT_EQ(Limit::kImpulse, stays.limit) << Describe(flying.description(), stays);
    EXPECT_NEAR(m, stays.radius, 4 * m * m);
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
