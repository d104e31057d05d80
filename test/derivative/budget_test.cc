// SPDX-License-Identifier: BSD-3-Clause
// Derivatives end with their budget, wherever they are then.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/budgets.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::Ended;
using test::ExpectEndsInTime;
using test::RunWithin;

/// A box that spins fast takes 10⁴ steps, and each some hundred Jacobians.
class FastBox : public testing::Test {
 protected:
  FastBox() : system(MakeModel("falling_box", {})), x(system->nominal().x) {
    x(2) = 1000;
    x.tail(3) << 1e5, 0.7e5, 0.4e5;
    run = Simulate(*system, x, system->nominal().u, 0.1);
  }
  const std::unique_ptr<MechanicalSystem> system;
  Vector x;
  Trajectory run;
};

TEST_F(FastBox, DerivativeEndsWithAStatus) {
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  for (const double seconds : {0.05, 0.5}) {
    BDerivative B;
    const Ended ended =
        RunWithin(test::Seconds(seconds), [&] { B = DifferentiateOutcome(*system, run); });
    EXPECT_EQ(ended.end, BudgetEnd::kNone) << "a derivative has a status";
    EXPECT_LT(ended.seconds, seconds + test::kPromise);
    EXPECT_EQ(B.status.outcome, Outcome::kBudgetExceeded);
    for (const char* part : {"max_seconds = ", "the tangents of the arcs"}) {
      EXPECT_NE(B.status.message.find(part), std::string::npos) << B.status.message;
    }
  }
}

TEST_F(FastBox, PerturbedRunsEnd) {
  const Vector w = Vector::Unit(12, 2);
  ExpectEndsInTime(
      [&] {
        CompareWithQuotients(*system, x, system->nominal().u, 10, w, w, {1e-3, 1e-4, 1e-5});
      },
      {0.02, 0.3});
}

/// Nine feet at once: 362880 orders.
class NineLegs : public testing::Test {
 protected:
  NineLegs() : system(test::Make<test::LegRow<9>>()) {
    run = Simulate(system, system.nominal().x, Vector(0), system.nominal().duration);
    options.max_activations_for_pieces = 9;
    options.max_pieces = 1000000;
    B = DifferentiateOutcome(system, run, options);
  }
  const ModelSystem<test::LegRow<9>> system;
  Trajectory run;
  BDerivativeOptions options;
  BDerivative B;
};

TEST_F(NineLegs, PiecesEndInTime) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  ExpectEndsInTime([&] { B.Pieces(); }, {0.01, 0.3});
}

TEST_F(NineLegs, PiecesThatDoNotFitAreRefusedWithFigures) {
  const Ended ended = RunWithin(test::Megabytes(1000), [&] { B.Pieces(); });
  EXPECT_EQ(ended.end, BudgetEnd::kMegabytes);
  EXPECT_LT(ended.seconds, 1) << "before they are made";
  // 9! (22² + 22·8) 8 bytes, or with all pairs in the cones 22·36: from 1.9 to 3.7 GB.
  for (const char* part : {"max_megabytes = 1000 ", "362880 pieces", "9 contacts", " MB"}) {
    EXPECT_NE(ended.message.find(part), std::string::npos) << ended.message;
  }
}

TEST_F(NineLegs, AValueAfterACancelledOneIsRight) {
  const BDerivative fresh = DifferentiateOutcome(system, run, options);
  for (int trial = 0; trial < 20; ++trial) {
    Vector w(22);
    for (int i = 0; i < w.size(); ++i) w(i) = std::cos(1.0 + trial + 3.1 * i);
    const BDerivative cancelled = DifferentiateOutcome(system, run, options);
    int questions = 0;  // ends after another number of them in each trial
    BudgetLimits limits;
    limits.cancelled = [&] { return ++questions > 3 * trial; };
    limits.look_every = 0;
    RunWithin(limits, [&] { cancelled(w); });
    EXPECT_EQ(cancelled(w), fresh(w)) << "trial " << trial;
  }
}

TEST(BudgetOfTwelveLegs, OrdersEndInTime) {
  const auto system = test::Make<test::LegRow<12>>();
  const Trajectory run = Simulate(system, system.nominal().x, Vector(0), system.nominal().duration);
  const BDerivative B = DifferentiateOutcome(system, run);
  const Ended ended = RunWithin(test::Seconds(0.001), [&] { B.PiecewiseLinear(); });
  EXPECT_EQ(ended.end, BudgetEnd::kSeconds);
  EXPECT_NE(ended.message.find("the orders of a cluster"), std::string::npos) << ended.message;
  EXPECT_TRUE(B.PiecewiseLinear().ok()) << "what was left unfinished is not kept";
}

}  // namespace
}  // namespace contact_flow
