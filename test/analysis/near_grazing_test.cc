// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/near_grazing.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::kGravity;
using test::Tight;

using GrazingKind = GrazingEvent::Kind;

class Ceiling : public testing::Test {
 protected:
  const std::unique_ptr<MechanicalSystem> system = MakeModel("ceiling");  // 1 m high
  /// A ball thrown up at this squared speed.
  Trajectory Throw(double squared, const SimulateOptions& options = Tight()) const {
    Vector x(2);
    x << 0, std::sqrt(squared);
    return Simulate(*system, x, Vector(0), 0.8, options);
  }
};

TEST_F(Ceiling, MissedByLittleIsNamedWithTimeAndGap) {
  for (double gap : {9e-7, 1e-8}) {
    const double squared = 2 * kGravity * (1 - gap);
    const std::vector<GrazingEvent> found = FindNearGrazing(*system, Throw(squared));
    ASSERT_EQ(1u, found.size());
    EXPECT_EQ(GrazingKind::kNearTouchdown, found[0].kind);
    EXPECT_EQ(0, found[0].constraint);
    // The rate of the gap is exact to ~1e-12 m/s, its turn to that over g.
    EXPECT_NEAR(std::sqrt(squared) / kGravity, found[0].t, 1e-11);
    EXPECT_NEAR(gap, found[0].value, 1e-11);
    EXPECT_EQ(1e-6, found[0].threshold);
    EXPECT_EQ(0u, Describe(system->description(), found[0])
                      .find("near grazing: the gap of 'ceiling' comes to "));
  }
  EXPECT_TRUE(FindNearGrazing(*system, Throw(2 * kGravity * (1 - 1.1e-6))).empty());
}

TEST_F(Ceiling, TouchedSlowlyIsNamedWithTimeAndSpeed) {
  constexpr double kSpeed = 5e-5;
  const double squared = 2 * kGravity + kSpeed * kSpeed;
  const std::vector<GrazingEvent> found = FindNearGrazing(*system, Throw(squared));
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(GrazingKind::kSlowTouchdown, found[0].kind);
  EXPECT_EQ(0, found[0].constraint);
  EXPECT_NEAR((std::sqrt(squared) - kSpeed) / kGravity, found[0].t, 1e-8);
  // v² is a difference of numbers ~20 known to 1e-12 (the gap at the event, times
  // 2g): v to 1e-12/v.
  EXPECT_NEAR(kSpeed, found[0].value, 2e-11 / kSpeed);
  EXPECT_TRUE(FindNearGrazing(*system, Throw(2 * kGravity + 2.1e-8)).empty()) << "1.4e-4 m/s";
}

TEST_F(Ceiling, WithoutTheMotionInBetweenConstraintAndTimeAreNotKnown) {
  SimulateOptions options = Tight();
  options.dense = false;
  const std::vector<GrazingEvent> found =
      FindNearGrazing(*system, Throw(2 * kGravity * (1 - 1e-7), options));
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(-1, found[0].constraint);
  EXPECT_TRUE(std::isnan(found[0].t));
  EXPECT_NEAR(1e-7, found[0].value, 1e-11);
  EXPECT_NE(std::string::npos,
            Describe(system->description(), found[0]).find("the gap of a constraint comes to"));
}

/// λ = load + cos t: at t = π it is load − 1.
std::vector<GrazingEvent> Press(double load) {
  const auto block = test::Make<test::PressedBlock>({{"load", load}});
  Vector x(4);
  x << 0, 0, 0, 1;
  return FindNearGrazing(block, Simulate(block, x, Vector(0), 4, Tight()));
}

TEST(PressedBlock, ThatNearlyLetsGoIsNamed) {
  const std::vector<GrazingEvent> found = Press(1 + 1e-5);
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(GrazingKind::kNearRelease, found[0].kind);
  EXPECT_EQ(0, found[0].constraint);
  EXPECT_NEAR(M_PI, found[0].t, 1e-9);
  EXPECT_NEAR(1e-5, found[0].value, 1e-11);
  EXPECT_TRUE(Press(1 + 2e-4).empty());
}

TEST(PressedBlock, ThatLetsGoSlowlyIsNamed) {
  constexpr double kDepth =
      1e-9;  // cos w = −1 + depth at w = π − √(2 depth), with the rate −√(2 depth)
  const std::vector<GrazingEvent> found = Press(1 - kDepth);
  ASSERT_EQ(1u, found.size());
  EXPECT_EQ(GrazingKind::kSlowRelease, found[0].kind);
  EXPECT_EQ(0, found[0].constraint);
  // The force is known to 1e-15, its root to that over the rate.
  EXPECT_NEAR(std::sqrt(2 * kDepth), found[0].value, 1e-9);
  EXPECT_NEAR(M_PI - std::sqrt(2 * kDepth), found[0].t, 1e-9);
  EXPECT_TRUE(Press(1 - 1e-8).empty()) << "a rate of 1.4e-4 N/s";
}

TEST(NearGrazing, IsNotFoundInTheNominalRuns) {
  int runs = 0;
  for (const std::string& name : ModelNames()) {
    const auto system = MakeModel(name);
    const NominalRun& nominal = system->nominal();
    const Trajectory run = Simulate(*system, nominal.x, nominal.u, nominal.duration);
    if (!run.status.ok()) continue;
    ++runs;
    for (const GrazingEvent& event : FindNearGrazing(*system, run)) {
      ADD_FAILURE() << name << ": " << Describe(system->description(), event);
    }
  }
  EXPECT_GT(runs, 10);
}

}  // namespace
}  // namespace contact_flow
