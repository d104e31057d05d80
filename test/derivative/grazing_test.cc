// SPDX-License-Identifier: BSD-3-Clause
// A ball thrown up under a ceiling (Sec. 6.1): the derivative near grazing in closed form.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kCeiling = 1, kRestitution = 0.5;

class UnderTheCeiling : public testing::Test {
 protected:
  static constexpr double kDuration = 0.6;

  UnderTheCeiling()
      : system(MakeModel("ceiling", {{"height", kCeiling}, {"restitution", kRestitution}})) {
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
  }
  /// The state from which it meets the ceiling at this speed.
  static Vector Thrown(double speed) {
    Vector x(2);
    x << 0, std::sqrt(2 * kGravity * kCeiling + speed * speed);
    return x;
  }
  BDerivative Differentiate(const Vector& x) const {
    return DifferentiateOutcome(*system, Simulate(*system, x, Vector(0), kDuration, options));
  }
  std::unique_ptr<MechanicalSystem> system;
  SimulateOptions options;
  const Vector faster = Vector::Unit(2, 1);  // δż(0) = 1
};

TEST_F(UnderTheCeiling, NoDerivativeAtGrazing) {
  const BDerivative B = Differentiate(Thrown(0));
  EXPECT_EQ(Outcome::kGrazing, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("'ceiling'")) << B.status.message;
}

/// The ball arrives at t₁ = (ż₀ − s)/g with speed s and leaves with −γ s, so that ż(T) = −γ s − g
/// (T − t₁).
TEST_F(UnderTheCeiling, GrowsLikeOneOverTheSpeed) {
  for (double s : {2.0, 0.5, 0.1, 1e-2, 1e-3, 1e-4}) {
    const Vector x = Thrown(s);
    const BDerivative B = Differentiate(x);
    ASSERT_TRUE(B.status.ok()) << "speed " << s << ": " << B.status.message;
    const double left = kDuration - (x(1) - s) / kGravity;
    const double ds = x(1) / s, dt = (1 - ds) / kGravity;
    Vector exact(2);
    exact << -kRestitution * ds * left + kRestitution * s * dt + kGravity * left * dt,
        -kRestitution * ds + kGravity * dt;
    // s is the root of a difference of numbers ~ 20 that are wrong by a few 1e-15.
    const double relative = 1e-9 + 1e-13 / (s * s);
    EXPECT_LE((B(faster) - exact).norm(), relative * exact.norm()) << "speed " << s;
    // s·B → −(1+γ) ż₀: what is left is s.
    EXPECT_NEAR(-(1 + kRestitution) * x(1), s * B(faster)(1), 1.1 * s + relative * 10);
  }
}

TEST_F(UnderTheCeiling, AgreesWithOneSidedQuotientsWellInside) {
  for (double s : {2.0, 0.1}) {
    for (double sign : {1.0, -1.0}) {
      const Vector x = Thrown(s), w = sign * faster;
      // The next order is α ż₀²/s³: perturbations must stay below s².
      const std::vector<double> alphas = {1e-2 * s * s, 3e-3 * s * s, 1e-3 * s * s, 3e-4 * s * s};
      const QuotientReport report =
          CompareWithQuotients(*system, x, Vector(0), kDuration, w, Differentiate(x)(w), alphas);
      EXPECT_NEAR(1, report.slope, 0.1) << "speed " << s;
    }
  }
}

}  // namespace
}  // namespace contact_flow
