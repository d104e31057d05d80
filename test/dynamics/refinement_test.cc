// SPDX-License-Identifier: BSD-3-Clause
// Dynamics and their derivatives where a part is light beside what constraints hold it to.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// A rimless wheel on the spoke whose foot is the origin, its hub at angle θ from the ground's
/// normal, is a pendulum upside down: θ̈ = (g/l) sin(θ + slope)/(1 + ρ), ρ = I/(m l²). The Delassus
/// matrix of the foot has the condition 1/ρ, (1a) itself about 1. Numbers of (1a) are some tens.
TEST(Refinement, WheelOfALightRim) {
  constexpr double kAngle = 0.3, kRate = -1.2, kGravity = 9.81, kSlope = 0.08;
  const double s = std::sin(kAngle), c = std::cos(kAngle);
  for (const double inertia : {1.0, 1e-4, 1e-7, 1e-9, 1e-11}) {
    const auto wheel = MakeModel("rimless_wheel", {{"inertia", inertia}, {"slope", kSlope}});
    Vector x(6);
    x << s, c, kAngle, c * kRate, -s * kRate, kRate;
    ContactMode stance;
    stance.Set(0, Letter::kStick);
    ContactDynamics dynamics(*wheel, Vector::Zero(0));
    dynamics.Differentiate(x, stance);
    const double factor = kGravity / (1 + inertia);
    EXPECT_NEAR(factor * std::sin(kAngle + kSlope), dynamics.acceleration()(2), 1e-12) << inertia;
    // The foot stays: the hub moves by (c, −s) δθ, and its rate with it.
    Vector w(6);
    w << c, -s, 1, -s * kRate, -c * kRate, 0;
    const double slope = (dynamics.acceleration_jacobian() * w)(2);
    EXPECT_NEAR(factor * std::cos(kAngle + kSlope), slope, 1e-11) << inertia;
    // λ_n = m (z̈ + g cos(slope)), z = cos θ.
    const Vector force_slope = dynamics.force_jacobian() * w;
    const double rate = factor * std::sin(kAngle + kSlope);
    const double change = factor * std::cos(kAngle + kSlope);
    const double normal = -s * change - c * rate + s * kRate * kRate;
    EXPECT_NEAR(normal, force_slope(0), 1e-10) << inertia;
  }
}

}  // namespace
}  // namespace contact_flow
