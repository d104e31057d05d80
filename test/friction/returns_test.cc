// SPDX-License-Identifier: BSD-3-Clause
// Return maps from starts that stick: a direction that makes the contact slip is stopped at once.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

/// A rod that stands on its foot, turned by `angle` and at rest.
Vector StandingRod(double angle) {
  Vector x = Vector::Zero(6);
  x(1) = 0.5 * std::cos(angle);
  x(2) = angle;
  return x;
}

PoincareOptions TightReturns() {
  PoincareOptions options;
  options.simulate = test::Tight();
  options.derivative.tolerance = 1e-10;
  return options;
}

/// Beside returns of starts nearby, which slip and are stopped, in their own time.
TEST(ReturnsWithFriction, OfAStartThatSticks) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const auto rod = MakeModel("sliding_rod", {{"friction", 1.2}});
  const Section sections[] = {Section::After(0.4), Section::Coordinate(*rod, "theta", 0.45, 1)};
  for (const Section& section : sections) {
    const PoincareMap map(*rod, Vector(0), section, TightReturns());
    const Vector x = StandingRod(0.3);
    const PoincareReturn at = map.Return(x);
    ASSERT_EQ(ReturnStatus::kReturned, at.status) << at.message;
    for (const double sign : {1.0, -1.0}) {
      // A slip of the foot, and one while it turns: ẋ − l cos θ θ̇ ≠ 0, ż + l sin θ θ̇ = 0.
      Vector slip = Vector::Zero(6), turn = Vector::Zero(6);
      slip(3) = sign;
      turn(5) = sign;
      turn(4) = -sign * 0.5 * std::sin(0.3);
      for (const Vector& w : {slip, turn}) {
        constexpr double kAlpha = 1e-6;
        const PoincareReturn near = map.Return(rod->Perturb(x, kAlpha * w));
        ASSERT_EQ(ReturnStatus::kReturned, near.status) << near.message;
        const Vector quotient = (near.x - at.x) / kAlpha;
        EXPECT_LE((at.map(w) - quotient).norm(), 3e-5) << w.transpose() << "\n"
                                                       << at.map(w).transpose() << "\n"
                                                       << quotient.transpose();
        EXPECT_NEAR((near.time - at.time) / kAlpha, at.return_time(w)(0), 3e-5);
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
