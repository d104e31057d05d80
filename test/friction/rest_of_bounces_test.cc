// SPDX-License-Identifier: BSD-3-Clause
// Bounces of what slips, completed to rest.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// While a puck slips, and whether it bounces or not, friction takes μ times what the floor gives
/// along z, which is m (u + g t) from its fall with u on: its speed is v₀ − μ (u + g t), whatever
/// its restitution, and where the bounces are taken to have ended.
TEST(RestOfBounces, TakesOfASlipWhatTheBouncesWould) {
  const double g = 9.81, mu = 0.4, fall = 0.1, u = g * fall, after = 0.3;
  const Eigen::Vector2d v(1.8, -2.4);
  for (const double restitution : {0.0, 1e-6, 1e-4, 0.01, 0.1, 0.3}) {
    const auto puck = MakeModel(
        "puck", {{"gravity", g}, {"friction", mu}, {"restitution", restitution}, {"mass", 2}});
    Vector x = puck->nominal().x;
    ASSERT_EQ(6, x.size());
    x << 0, 0, 0.5 * g * fall * fall, v, 0;
    SimulateOptions options;
    options.complete_zeno = true;
    const Trajectory run =
        Simulate(*puck, x, Vector::Zero(puck->num_inputs()), fall + after, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_EQ(Letter::kSlip, run.arcs.back().mode.LetterOf(0));
    EXPECT_EQ(restitution > 0, run.transitions.back().completes_zeno);
    const Vector expected = v - mu * (u + g * after) * v.normalized();
    EXPECT_LT((run.FinalState().segment<2>(3) - expected).norm(), 1e-8) << restitution;
  }
}

}  // namespace
}  // namespace contact_flow
