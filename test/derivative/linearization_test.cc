// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/linearization.h"

#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// A box pushed by an input on a grid, with a bounce inside the last interval.
class LinearizationTest : public testing::Test {
 protected:
  LinearizationTest() : box(MakeModel("falling_box")) {
    exact.relative_tolerance = exact.absolute_tolerance = 1e-12;
    schedule.grid = {0, 0.15, 0.3};
    for (int k = 0; k < 3; ++k) {
      schedule.values.push_back(0.3 * Vector::LinSpaced(6, -1, 1 + k));
      schedule.values.back().tail(3) *= 0.01;
    }
    run = Simulate(*box, box->nominal().x, schedule, 0.41, exact);
    BDerivativeOptions options;
    options.tolerance = 1e-11;
    intervals = Linearize(*box, run, options);
  }
  /// Central quotients of the outcome: the run is differentiable, error O(α²) + rounding/α ~ 1e-7.
  Vector Quotient(int interval, int input) const {
    constexpr double kAlpha = 1e-5;
    InputSchedule plus = schedule, minus = schedule;
    plus.values[interval](input) += kAlpha;
    minus.values[interval](input) -= kAlpha;
    const Vector& x = box->nominal().x;
    return box->Separation(Simulate(*box, x, plus, 0.41, exact).FinalState(),
                           Simulate(*box, x, minus, 0.41, exact).FinalState()) /
           (2 * kAlpha);
  }

  std::unique_ptr<MechanicalSystem> box;
  SimulateOptions exact;
  InputSchedule schedule;
  Trajectory run;
  std::vector<IntervalLinearization> intervals;
};

TEST_F(LinearizationTest, OneForEachIntervalOfTheGrid) {
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(3u, intervals.size());
  for (int k = 0; k < 3; ++k) {
    EXPECT_EQ(schedule.grid[k], intervals[k].t_begin);
    EXPECT_TRUE(intervals[k].status.ok()) << intervals[k].status.message;
    EXPECT_TRUE(intervals[k].is_linear);
    EXPECT_EQ(12, intervals[k].A.rows());
    EXPECT_EQ(6, intervals[k].B.cols());
  }
  EXPECT_EQ(1u, intervals[2].derivative.events.size());
}

TEST_F(LinearizationTest, ProductsAreTheDerivativesByTheInputsOfEachInterval) {
  ASSERT_EQ(3u, intervals.size());
  for (int k = 0; k < 3; ++k) {
    Matrix chained = intervals[k].B;
    for (int later = k + 1; later < 3; ++later) chained = intervals[later].A * chained;
    for (int input = 0; input < 6; ++input) {
      EXPECT_LE((chained.col(input) - Quotient(k, input)).cwiseAbs().maxCoeff(),
                1e-5 * (1 + chained.col(input).norm()))
          << "interval " << k << ", input " << input;
    }
  }
}

/// Their product by the state is the derivative of the whole run.
TEST_F(LinearizationTest, ProductIsTheWholeDerivative) {
  const BDerivative whole = DifferentiateOutcome(*box, run);
  const Matrix product = intervals[2].A * intervals[1].A * intervals[0].A;
  for (int k = 0; k < 12; ++k) {
    EXPECT_LE((whole(Vector::Unit(12, k)) - product.col(k)).norm(), 1e-7 * (1 + product.norm()));
  }
}

/// A change of input at the very instant of a landing is an event with it: two orders, and the
/// landing belongs to the interval that ends there.
TEST(Linearization, EventAtAnInstantOfTheGridHasTwoPieces) {
  const auto box = MakeModel("falling_box");
  const Trajectory free = Simulate(*box, box->nominal().x, Vector::Zero(6), 0.41);
  InputSchedule schedule;
  schedule.grid = {0, free.transitions.front().t};
  schedule.values = {Vector::Zero(6), Vector::Ones(6)};
  const Trajectory run = Simulate(*box, box->nominal().x, schedule, 0.41);
  ASSERT_EQ(2u, run.transitions.size());
  const BDerivative derivative = DifferentiateOutcome(*box, run);
  ASSERT_TRUE(derivative.status.ok()) << derivative.status.message;
  EXPECT_FALSE(derivative.IsDifferentiable());
  EXPECT_EQ(2u, derivative.Pieces().pieces().size());
  const std::vector<IntervalLinearization> intervals = Linearize(*box, run);
  ASSERT_EQ(2u, intervals.size());
  EXPECT_FALSE(intervals[0].is_linear);
  EXPECT_TRUE(intervals[1].is_linear);
  EXPECT_EQ(1u, intervals[0].derivative.events.size());
}

/// Simultaneous touchdown inside an interval: said so, and all selections are there.
/// Runs so short that squares and quotients of their lengths are 0 or infinite: what is answered is
/// finite, what is not is refused.
TEST(Linearization, OfTheShortestRunsIsFiniteOrRefused) {
  int refused = 0;
  for (const char* name : {"block_on_incline", "soft_biped", "puck"}) {
    const auto system = MakeModel(name);
    Vector x = system->nominal().x;
    x(0) += 0.5;
    for (const double duration : {5e-324, 1e-310, 1e-300, 1e-160, 1e-100}) {
      const Trajectory run = Simulate(*system, x, system->nominal().u, duration, {});
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      for (const IntervalLinearization& interval : Linearize(*system, run, {})) {
        if (interval.status.ok()) {
          EXPECT_TRUE(interval.A.allFinite() && interval.B.allFinite()) << name << duration;
        } else {
          EXPECT_NE(interval.status.message.find("beyond the numbers"), std::string::npos)
              << interval.status.message;
          ++refused;
        }
      }
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(Linearization, PiecewiseLinearEventsAreMarked) {
  const auto biped = MakeModel("soft_biped");
  Vector x = biped->nominal().x;
  x(6) = 0;
  const Trajectory run = Simulate(*biped, x, Vector(0), 1.2);
  const std::vector<IntervalLinearization> intervals = Linearize(*biped, run);
  ASSERT_EQ(1u, intervals.size());
  ASSERT_TRUE(intervals[0].status.ok());
  EXPECT_FALSE(intervals[0].is_linear);
  EXPECT_EQ(2u, intervals[0].derivative.Pieces().pieces().size());
}

}  // namespace
}  // namespace contact_flow
