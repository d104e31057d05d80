// SPDX-License-Identifier: BSD-3-Clause
// A rod that slides into the singular point of its slip (Painlevé), beside a floor that gives way a
// little: stiffer and stiffer, its motion goes to that of the impact without collision.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/systems/rod.h"

namespace contact_flow {
namespace {

constexpr double kLength = 0.5, kGravity = 9.81, kFriction = 1.6;
constexpr double kInertia = kLength * kLength / 3;

using State = std::array<double, 6>;  // x, z, θ and their rates

/// Forces of a spring and a damper at the foot, friction by a steep tanh: no impulses, no modes.
State CompliantField(const State& y, double stiffness) {
  const double l = kLength, s = std::sin(y[2]), c = std::cos(y[2]);
  const double gap = y[1] - l * c, closing = y[4] + l * s * y[5], slip = y[3] - l * c * y[5];
  const double damping = 2 * std::sqrt(stiffness / 4);
  const double N = gap < 0 ? std::max(0.0, -stiffness * gap - damping * closing) : 0.0;
  const double T = -kFriction * N * std::tanh(slip / 1e-4);
  return {y[3], y[4], y[5], T, N - kGravity, (N * l * s - T * l * c) / kInertia};
}

State CompliantRun(State y, double duration, double stiffness) {
  const int steps = static_cast<int>(std::ceil(duration * std::sqrt(stiffness) * 200));
  const double h = duration / steps;
  const auto beside = [&y](const State& slope, double h) {
    State z = y;
    for (std::size_t i = 0; i < 6; ++i) z[i] += h * slope[i];
    return z;
  };
  for (int k = 0; k < steps; ++k) {
    const State a = CompliantField(y, stiffness);
    const State b = CompliantField(beside(a, h / 2), stiffness);
    const State c = CompliantField(beside(b, h / 2), stiffness);
    const State d = CompliantField(beside(c, h), stiffness);
    for (std::size_t i = 0; i < 6; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}

TEST(Jam, IsTheLimitOfFloorsThatGiveWay) {
  const auto rod = MakeSystem<test::Rod>({{"mu0", kFriction},
                                          {"mu1", kFriction},
                                          {"mass", 1},
                                          {"half_length", kLength},
                                          {"gravity", kGravity}});
  const double theta = 0.78, slip = -2;
  for (const double rate : {-3.3, -4.0}) {
    const double s = std::sin(theta), c = std::cos(theta), l = kLength;
    const State start = {0, l * c, theta, slip + l * c * rate, -l * s * rate, rate};
    const Vector x = Eigen::Map<const Vector>(start.data(), 6);
    const Trajectory run = Simulate(*rod, x, Vector::Zero(0), 0.01);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_FALSE(run.transitions.empty());
    const Transition& jam = run.transitions.front();
    EXPECT_EQ("-o", run.arcs.front().mode.Word(2)) << rate;
    EXPECT_EQ(Outcome::kPainleveCrossing, jam.obstacle.outcome) << jam.obstacle.message;
    EXPECT_FALSE(run.warnings.empty());
    // 2 ms later.
    const double T = jam.t + 2e-3;
    const Vector rigid = run.State(T);
    double before = 0;
    for (const double stiffness : {1e8, 1e10}) {
      const State y = CompliantRun(start, T, stiffness);
      const double off = (Eigen::Map<const Vector>(y.data(), 6) - rigid).cwiseAbs().maxCoeff();
      std::printf("rate %g, stiffness %g: %.4f of %.4f\n", rate, stiffness, off,
                  rigid.cwiseAbs().maxCoeff());
      EXPECT_LE(off, 0.05) << rigid.transpose();
      if (stiffness > 1e9) EXPECT_LT(off, before);
      before = off;
    }
    EXPECT_FALSE(DifferentiateOutcome(*rod, run).status.ok());
  }
}

}  // namespace
}  // namespace contact_flow
