// SPDX-License-Identifier: BSD-3-Clause
// What a run costs between the events of one cluster.
#include <gtest/gtest.h>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// A ball whose input changes half a millisecond behind its touchdown, which is one cluster within
/// a millisecond: ∫ 1 dt is the duration all the same, whether l names the mode or not.
TEST(CostOfACluster, ArcsInsideCount) {
  const auto ball = MakeModel("driven_ball");
  Vector x(2);
  x << 0.5, 0.1;
  const double T = 0.5;
  SimulateOptions options;
  options.simultaneity_tolerance = 1e-3;
  const Vector rest = Vector::Zero(1), push = Vector::Ones(1);
  const Trajectory fall = Simulate(*ball, x, rest, T, options);
  ASSERT_FALSE(fall.transitions.empty());
  const double changes = fall.transitions.front().t + 5e-4;
  const InputSchedule schedule = {{0, changes}, {rest, push}};
  const Trajectory run = Simulate(*ball, x, schedule, T, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  RunCost plain, in_mode;
  plain.running = [](double, const Vector&, const Vector&, CostRate* rate) { rate->value = 1; };
  in_mode.running_in_mode = [](double, const Vector&, const Vector&, ContactMode, CostRate* rate) {
    rate->value = 1;
  };
  RunDirection later;
  later.initial = Vector::Unit(2, 0);
  for (const RunCost& cost : {plain, in_mode}) {
    const CostGradient J = DifferentiateCost(*ball, run, cost, {}, &later);
    ASSERT_TRUE(J.status.ok()) << J.status.message;
    EXPECT_NEAR(T, J.cost, 1e-12);
    EXPECT_NEAR(1, J.horizon, 1e-12);
    EXPECT_LT(J.initial.cwiseAbs().maxCoeff(), 1e-12);
  }
}

/// An arc without length has the rate of its mode, too: a run of no duration becomes dearer by l.
TEST(CostOfACluster, ArcsWithoutLengthHaveARate) {
  const auto ball = MakeModel("driven_ball");
  const Trajectory run = Simulate(*ball, Vector::Unit(2, 0), Vector::Zero(1), 0);
  RunCost cost;
  cost.running_in_mode = [](double, const Vector&, const Vector&, ContactMode, CostRate* rate) {
    rate->value = 3;
  };
  const CostGradient J = DifferentiateCost(*ball, run, cost);
  ASSERT_TRUE(J.status.ok()) << J.status.message;
  EXPECT_EQ(0, J.cost);
  EXPECT_EQ(3, J.horizon);
}

}  // namespace
}  // namespace contact_flow
