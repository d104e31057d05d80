// SPDX-License-Identifier: BSD-3-Clause
// Runs that end where something is hit: the outcome jumps by the instant of the touchdown.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kHeight = 1;

class EndEvent : public testing::TestWithParam<double> {
 protected:
  EndEvent()
      : ball(MakeModel("bouncing_ball", {{"gravity", kGravity}, {"restitution", GetParam()}})),
        x(Vector::Zero(4)) {
    x(1) = kHeight;
  }
  BDerivative Differentiate(double duration) const {
    return DifferentiateOutcome(*ball, Simulate(*ball, x, Vector(0), duration));
  }
  const double touch = std::sqrt(2 * kHeight / kGravity);
  std::unique_ptr<MechanicalSystem> ball;
  Vector x;
};

/// Thrown down by α m/s it is hit before the end, thrown up it is not: ż(T) jumps by (1 + γ) g t₁.
TEST_P(EndEvent, HasNoDerivativeThere) {
  for (const double apart : {0.0, 1e-16, -1e-16, 3e-15, -3e-15}) {
    const BDerivative B = Differentiate(touch + apart);
    EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome) << apart << ' ' << B.status.message;
    EXPECT_NE(std::string::npos, B.status.message.find("'floor' is hit at t = 0.45152364098"))
        << B.status.message;
    EXPECT_THROW(B(Vector::Unit(4, 3)), std::domain_error);
  }
  for (const double sign : {1.0, -1.0}) {
    Vector moved = x;
    moved(3) = sign * 1e-9;
    const Vector end = Simulate(*ball, moved, Vector(0), touch).FinalState();
    EXPECT_NEAR((sign > 0 ? -1 : GetParam()) * kGravity * touch, end(3), 1e-7);
  }
}

TEST_P(EndEvent, HasOneBesideIt) {
  const Vector w = Vector::Unit(4, 3);
  for (const double apart : {1e-3, -1e-3}) {
    const BDerivative B = Differentiate(touch + apart);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (const double sign : {1.0, -1.0}) {
      const QuotientReport report = CompareWithQuotients(*ball, x, Vector(0), touch + apart,
                                                         sign * w, B(sign * w), {1e-5, 1e-6});
      // Second derivatives of γ v and of γ v (T − t₁) are of order 1.
      for (const QuotientSample& sample : report.samples) EXPECT_LE(sample.error, 1e-4);
    }
  }
}

/// An online run that is looked at there, a millisecond before and after; gradients and intervals.
TEST_P(EndEvent, IsNoneForReadingsAndGradients) {
  const SimulateOptions options;
  const std::shared_ptr<const MechanicalSystem> system =
      MakeModel("bouncing_ball", {{"gravity", kGravity}, {"restitution", GetParam()}});
  OnlineFlow run(system, 0, x, Vector(0), options);
  RollingDerivative rolling(&run, Vector::Unit(4, 3), {}, options);
  for (const double apart : {-1e-3, 0.0, 1e-3}) {
    bool passed = true;
    while (passed) {
      passed = run.AdvanceTo(touch + apart);
      rolling.Follow(&run, passed);
    }
    const Status status = rolling.Read(&run).status;
    EXPECT_EQ(apart == 0 ? Outcome::kDiscontinuous : Outcome::kOk, status.outcome) << apart;
    const Trajectory whole = Simulate(*ball, x, Vector(0), touch + apart);
    RunCost cost;
    cost.terminal = [](const Vector& end, Vector* by_state) {
      *by_state = Vector::Unit(end.size(), 3);
      return end(3);
    };
    EXPECT_EQ(status.outcome, DifferentiateCost(*ball, whole, cost, {}).status.outcome) << apart;
    EXPECT_EQ(status.outcome, Linearize(*ball, whole).back().status.outcome) << apart;
  }
}

INSTANTIATE_TEST_SUITE_P(Restitution, EndEvent, testing::Values(0.0, 0.5, 1.0));

}  // namespace
}  // namespace contact_flow
