// SPDX-License-Identifier: BSD-3-Clause
// Runs that end where their input changes: longer ones have another derivative by T.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

constexpr double kEnd = 0.3;

InputSchedule Pushed(double before, double after) {
  InputSchedule schedule;
  schedule.grid = {0, kEnd};
  schedule.values = {Vector::Constant(1, before), Vector::Constant(1, after)};
  return schedule;
}

TEST(InputChangeAtEnd, LongerRunsAreRefused) {
  const auto ball = MakeModel("driven_ball");
  Vector x(2), none = Vector::Zero(2);
  x << 4, 0;
  const auto run_to = [&](const InputSchedule& schedule, double duration) {
    return Simulate(*ball, x, schedule, duration);
  };
  const InputSchedule schedule = Pushed(0, 20);
  const Trajectory run = run_to(schedule, kEnd);
  const BDerivative B = DifferentiateOutcome(*ball, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const double step = 1e-6;
  const Vector shorter = (run_to(schedule, kEnd - step).FinalState() - run.FinalState()) / step;
  EXPECT_LE((shorter - B(-1, none)).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_THROW(B(1, none), std::domain_error);
  EXPECT_NO_THROW(B(0, none));
  RunCost cost;
  cost.terminal = [](const Vector& end, Vector* by_state) {
    (*by_state)(0) = 1;
    return end(0);
  };
  EXPECT_TRUE(std::isnan(DifferentiateCost(*ball, run, cost).horizon));
  // The end is an instant that its rounding tells apart from it, too: 0.1 + 0.2 > 0.3.
  for (const double end : {0.1 + 0.2, std::nextafter(kEnd, 0)}) {
    const BDerivative near = DifferentiateOutcome(*ball, run_to(schedule, end));
    EXPECT_THROW(near(1, none), std::domain_error);
    EXPECT_LE((shorter - near(-1, none)).cwiseAbs().maxCoeff(), 1e-4);
  }
  // Where it stays, or changes elsewhere, both sides are one.
  for (const Trajectory& other : {run_to(Pushed(20, 20), kEnd), run_to(schedule, kEnd + 0.1)}) {
    const BDerivative both = DifferentiateOutcome(*ball, other);
    EXPECT_EQ(both(1, none), -both(-1, none));
  }
}

}  // namespace
}  // namespace contact_flow
