// SPDX-License-Identifier: BSD-3-Clause
// Twelve simultaneous contacts: one direction in polynomial time, all pieces refused.
#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

constexpr int kLegs = 12;

class TwelveLegs : public testing::Test {
 protected:
  TwelveLegs() : system(test::Make<test::LegRow<kLegs>>()) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    run = Simulate(system, system.nominal().x, Vector(0), system.nominal().duration, options);
    B = DifferentiateOutcome(system, run);
  }
  Vector RandomDirection() {
    std::normal_distribution<double> normal;
    Vector w(2 * system.dof());
    for (int i = 0; i < w.size(); ++i) w(i) = normal(generator);
    return w;
  }

  const ModelSystem<test::LegRow<kLegs>> system;
  Trajectory run;
  BDerivative B;
  std::mt19937 generator{11};
};

TEST_F(TwelveLegs, LandTogether) {
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(kLegs, run.transitions.front().activated.Size());
  EXPECT_NEAR(1, run.transitions.front().t, 1e-11);
}

TEST_F(TwelveLegs, ADirectionCostsOneFieldForEachStage) {
  const EventMap& event = B.events.front();
  // The derivative has checked itself along one direction, F⁻.
  EXPECT_EQ(kLegs + 1, event.field_evaluations());
  EXPECT_EQ(kLegs, event.reset_evaluations());
  const Vector w = RandomDirection();
  B(w);
  const long stages = event.field_evaluations();
  EXPECT_LE(stages, 2 * kLegs) << "one for each event that another order had not met";
  B(2 * w);
  EXPECT_EQ(stages, event.field_evaluations()) << "stages are kept";
}

TEST_F(TwelveLegs, DirectionsAgreeWithOneSidedQuotients) {
  for (int trial = 0; trial < 5; ++trial) {
    const Vector w = RandomDirection();
    const QuotientReport report =
        CompareWithQuotients(system, system.nominal().x, Vector(0), system.nominal().duration, w,
                             B(w), {1e-3, 3e-4, 1e-4, 3e-5});
    EXPECT_NEAR(1, report.slope, 0.15) << "trial " << trial;
    EXPECT_LE(report.samples.back().error, 1e-1 * report.samples.front().error);
    EXPECT_EQ(kLegs + 1u, report.samples.front().modes.size()) << "the feet land one by one";
  }
}

TEST_F(TwelveLegs, AllPiecesAreRefusedWithTheLimit) {
  try {
    B.Pieces();
    FAIL() << "12! pieces were not refused";
  } catch (const std::length_error& refusal) {
    const std::string text = refusal.what();
    EXPECT_NE(std::string::npos, text.find("12!")) << text;
    EXPECT_NE(std::string::npos, text.find("at most 7")) << text;
  }
}

TEST_F(TwelveLegs, AreNotDifferentiable) { EXPECT_FALSE(B.IsDifferentiable()); }

}  // namespace
}  // namespace contact_flow
