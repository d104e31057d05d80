// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/dop853.h"

#include <gtest/gtest.h>

#include <cmath>

namespace contact_flow {
namespace {

/// The pendulum-like equation ẍ = −sin x has no special structure; its reference is made
/// with tiny steps.
void PendulumRate(const double* x, double* xdot) {
  xdot[0] = x[1];
  xdot[1] = -std::sin(x[0]);
}

Vector PendulumStart() {
  Vector x(2);
  x << 1, 0.3;
  return x;
}

Vector PendulumAfter(double time, int steps) {
  Dop853 stepper(2, PendulumRate);
  stepper.Begin(PendulumStart());
  for (int k = 0; k < steps; ++k) {
    stepper.TryStep(time / steps, 1e-6, 1e-6);
    stepper.Finish();
    stepper.Advance();
  }
  return stepper.begin();
}

TEST(Dop853, HasOrderEight) {
  const Vector exact = PendulumAfter(2, 64);
  const double coarse = (PendulumAfter(2, 2) - exact).norm(),
               fine = (PendulumAfter(2, 4) - exact).norm();
  // Halving the step divides the error by 2⁸, give or take the next term of its expansion.
  EXPECT_GT(std::log2(coarse / fine), 7.3);
}

TEST(Dop853, TheContinuousExtensionHasOrderSeven) {
  const auto error = [](double h) {
    Dop853 stepper(2, PendulumRate);
    stepper.Begin(PendulumStart());
    stepper.TryStep(h, 1e-6, 1e-6);
    stepper.Finish();
    stepper.Extend();
    double worst = 0;
    for (double theta : {0.2, 0.5, 0.8}) {
      Vector x(2);
      stepper.Interpolate(theta, x.data());
      worst = std::max(worst, (x - PendulumAfter(theta * h, 20)).norm());
    }
    return worst;
  };
  EXPECT_GT(std::log2(error(1.0) / error(0.5)), 7.3);  // local error h⁸
}

TEST(Dop853, TheExtensionMeetsBothEnds) {
  Dop853 stepper(2, PendulumRate);
  stepper.Begin(PendulumStart());
  stepper.TryStep(0.7, 1e-6, 1e-6);
  stepper.Finish();
  stepper.Extend();
  Vector x(2);
  stepper.Interpolate(0, x.data());
  EXPECT_EQ(0, (x - stepper.begin()).norm());
  stepper.Interpolate(1, x.data());
  EXPECT_LE((x - stepper.end()).norm(), 1e-15);
}

TEST(Dop853, TheErrorEstimateCoversTheError) {
  for (double h : {0.2, 0.4, 0.6}) {
    Dop853 stepper(2, PendulumRate);
    stepper.Begin(PendulumStart());
    constexpr double kTolerance = 1e-9;
    const double estimate = kTolerance * stepper.TryStep(h, kTolerance, kTolerance);
    const double error = (stepper.end() - PendulumAfter(h, 20)).cwiseAbs().maxCoeff();
    EXPECT_GT(2 * estimate, error) << "h = " << h;
  }
}

TEST(Dop853, AStepMayBeRepeatedFromTheSamePoint) {
  Dop853 stepper(2, PendulumRate);
  stepper.Begin(PendulumStart());
  stepper.TryStep(0.4, 1e-6, 1e-6);
  const Vector once = stepper.end();
  stepper.TryStep(0.9, 1e-6, 1e-6);
  stepper.Finish();
  stepper.TryStep(0.4, 1e-6, 1e-6);
  EXPECT_EQ(0, (stepper.end() - once).norm());
}

}  // namespace
}  // namespace contact_flow
