// SPDX-License-Identifier: BSD-3-Clause
// A box in the plane that stands on two corners: four rows that stick and three freedoms. Forces
// are not unique, the motion is.
#include "test/friction/systems/flat_box.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/friction/confirmed.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

SimulateOptions TightAtSize(double size = 1) {
  SimulateOptions options;
  options.relative_tolerance = 1e-12;
  options.absolute_tolerance = std::max(1e-15, 1e-12 * size);
  options.gap_tolerance = 1e-9 * size;
  options.speed_tolerance = 1e-9 * size;
  return options;
}

Vector StandingInPlane(double height) {
  Vector x = Vector::Zero(8);
  x(1) = 0.5 * height;
  x(7) = 1;
  return x;
}

/// Tilted by `pitch` < 0 on its right corner, and turning about it.
Vector TiltedInPlane(double width, double height, double pitch, double rate) {
  const double c = std::cos(pitch), s = std::sin(pitch);
  const double across = -0.5 * width * c - 0.5 * height * s,  // from the corner to the centre
      up = 0.5 * height * c - 0.5 * width * s;
  Vector x = Vector::Zero(8);
  x(0) = across;
  x(1) = up;
  x(2) = pitch;
  x(4) = -up * rate;
  x(5) = across * rate;
  x(6) = rate;
  x(7) = 1;
  return x;
}

void ExpectConfirmedInPlane(const MechanicalSystem& system, const Vector& x, double push,
                            double duration, const BDerivative& B, const Vector& w,
                            double size = 1) {
  const Vector u = Vector::Constant(1, push);
  const QuotientReport report = CompareWithQuotients(
      system, x, u, duration, w, B(w), {1e-3 * size, 1e-4 * size, 1e-5 * size}, TightAtSize(size));
  test::ExpectConfirmed(report, B, w);
}

/// Nothing pushes: half of the weight on each corner, no force along the floor.
TEST(FlatBox, Stands) {
  const auto system = MakeSystem<test::FlatBox>({});
  const Trajectory run = Simulate(*system, StandingInPlane(1), Vector::Zero(1), 1, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_EQ("ss", run.arcs[0].mode.Word(2));
  EXPECT_LT((run.FinalState() - StandingInPlane(1)).head(3).cwiseAbs().maxCoeff(), 1e-12);
  ContactDynamics dynamics(*system, Vector::Zero(1));
  dynamics.Evaluate(run.FinalState(), run.arcs[0].mode);
  EXPECT_EQ(ConstraintSet({0, 1}), dynamics.shared());
  EXPECT_NEAR(kGravity, dynamics.force()(0), 1e-12);
  EXPECT_NEAR(kGravity, dynamics.force()(1), 1e-12);
  EXPECT_NEAR(0, dynamics.force().tail(2).norm(), 1e-12);
  ASSERT_FALSE(run.warnings.empty());
  EXPECT_EQ(Outcome::kIndeterminateForces, run.warnings[0].code);
}

/// λ = (n₁, n₂, t₁, t₂) with n₁ + n₂ = m g, (n₂ − n₁) w/2 = F arm, t₁ + t₂ = −F. The smallest has
/// t₁ = t₂; where that leaves the cone of the lighter corner, t₁ = −μ n₁.
TEST(FlatBox, SharesTheSmallestForces) {
  const auto system = MakeSystem<test::FlatBox>({});
  ContactDynamics dynamics(*system, Vector::Zero(1));
  const ContactMode both = InitialMode(*system, StandingInPlane(1), Vector::Zero(1));
  for (const double push : {0.5, 1.0, 2.0, 3.0, 4.0, 4.8}) {
    dynamics.SetInput(Vector::Constant(1, push));
    dynamics.Evaluate(StandingInPlane(1), both);
    const double n1 = kGravity - push * 0.8 / 0.4, n2 = 2 * kGravity - n1;
    const double t1 = -std::min(0.5 * push, 0.8 * n1);
    EXPECT_NEAR(n1, dynamics.force()(0), 1e-10) << push;
    EXPECT_NEAR(n2, dynamics.force()(1), 1e-10) << push;
    EXPECT_NEAR(t1, dynamics.force()(2), 1e-7) << push;
    EXPECT_NEAR(-push - t1, dynamics.force()(3), 1e-7) << push;
    // The roomiest: μ n₁, or half of what both have left.
    EXPECT_NEAR(std::min(0.8 * n1, 0.5 * (0.8 * 2 * kGravity - push)), dynamics.shared_margin(),
                1e-10)
        << push;
    EXPECT_NEAR(0, dynamics.acceleration().norm(), 1e-12);
  }
}

/// F = rate t turns it over its right corner when F arm = m g w/2, that is F = m g/4.
TEST(FlatBox, TipsWhenThePushReachesItsEdge) {
  const auto system = MakeSystem<test::FlatBox>({{"rate", 4}});
  const double tips = 2 * kGravity / 4 / 4;
  const Trajectory run =
      Simulate(*system, StandingInPlane(1), Vector::Zero(1), tips + 0.2, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("ss", run.arcs[0].mode.Word(2));
  EXPECT_EQ("os", run.arcs[1].mode.Word(2));
  EXPECT_NEAR(tips, run.transitions[0].t, 1e-11);
  EXPECT_LT(run.FinalState()(2), -1e-3);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const int j : {3, 7}) {
    ExpectConfirmedInPlane(*system, StandingInPlane(1), 0, tips + 0.2, B, Vector::Unit(8, j));
  }
  // A slip would tip it before it stops, as μ height > width: that is not followed.
  EXPECT_FALSE(B.IsDifferentiable());
  EXPECT_THROW(B(Vector::Unit(8, 4)), std::domain_error);
}

/// With μ height < width a slip stops while both corners stay down.
TEST(FlatBox, IsDifferentiableWhereNoSlipTipsIt) {
  const auto system = MakeSystem<test::FlatBox>({{"friction", 0.3}});
  const Trajectory run = Simulate(*system, StandingInPlane(1), Vector::Zero(1), 0.2, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(*system, run);
  EXPECT_EQ(HaveLinearPrograms(), B.IsDifferentiable());
  for (const double sign : {1.0, -1.0}) {
    ExpectConfirmedInPlane(*system, StandingInPlane(1), 0, 0.2, B, sign * Vector::Unit(8, 4));
  }
}

/// With μ < w/(2 arm) it slips before, when F = μ m g, and its corners share the weight as before.
TEST(FlatBox, SlipsWhenThePushLeavesItsCone) {
  const auto system = MakeSystem<test::FlatBox>({{"rate", 4}, {"friction", 0.2}});
  const double slips = 0.2 * 2 * kGravity / 4;
  const Trajectory run =
      Simulate(*system, StandingInPlane(1), Vector::Zero(1), slips + 0.2, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("++", run.arcs[1].mode.Word(2));
  EXPECT_NEAR(slips, run.transitions[0].t, 1e-11);
  // m ẍ = rate τ.
  EXPECT_NEAR(4 * std::pow(0.2, 3) / 6 / 2, run.FinalState()(0), 1e-11);
  EXPECT_NEAR(0, run.FinalState()(2), 1e-12);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const int j : {3, 7}) {
    ExpectConfirmedInPlane(*system, StandingInPlane(1), 0, slips + 0.2, B, Vector::Unit(8, j));
  }
}

/// Thrown along the floor it stops on both corners at once: x = v²/(2 μ g).
TEST(FlatBox, SlidesAndStops) {
  const auto system = MakeSystem<test::FlatBox>({{"friction", 0.3}});
  Vector x = StandingInPlane(1);
  x(4) = 1;
  const double stops = 1 / (0.3 * kGravity);
  const Trajectory run = Simulate(*system, x, Vector::Zero(1), stops + 0.5, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("++", run.arcs[0].mode.Word(2));
  EXPECT_EQ("ss", run.arcs[1].mode.Word(2));
  EXPECT_NEAR(stops, run.transitions[0].t, 1e-11);
  EXPECT_NEAR(0.5 * stops, run.FinalState()(0), 1e-11);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const int j : {0, 4}) {
    ExpectConfirmedInPlane(*system, x, 0, stops + 0.5, B, Vector::Unit(8, j));
  }
  EXPECT_NEAR(stops, B(Vector::Unit(8, 4))(0), 1e-9);
}

/// Tilted about its right corner it falls back and stands, as it is wide enough: a more slender one
/// would go on with 1 − 3/2 sin²α of its rate, tan α = w/h.
TEST(FlatBox, LandsFlat) {
  const auto system = MakeSystem<test::FlatBox>({{"width", 1.6}});
  const Vector start = TiltedInPlane(1.6, 1, -0.02, -0.8);
  const Trajectory run = Simulate(*system, start, Vector::Zero(1), 0.5, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("os", run.arcs[0].mode.Word(2));
  EXPECT_EQ("ss", run.arcs[1].mode.Word(2));
  EXPECT_LT(run.FinalState().tail(4).head(3).norm(), 1e-12);
  EXPECT_NEAR(0, run.FinalState()(2), 1e-11);
  EXPECT_LT(run.transitions[0].energy_change, 0);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  Vector w = ProjectAdmissible(*system, start, run.arcs[0].mode, Vector::LinSpaced(8, 0.3, 1));
  ExpectConfirmedInPlane(*system, start, 0, 0.5, B, w);
}

/// A slender one rocks: the rate of its pitch falls by 1 − 3/2 sin²α, tan α = w/h (Housner).
TEST(FlatBox, Rocks) {
  const auto system = MakeSystem<test::FlatBox>({{"width", 0.25}});
  const Vector start = TiltedInPlane(0.25, 1, -0.05, 0);
  const Trajectory run = Simulate(*system, start, Vector::Zero(1), 0.5, TightAtSize());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size()) << run.transitions.back().t;
  EXPECT_EQ("so", run.arcs[1].mode.Word(2));
  const double sine = 0.25 * 0.25 / (1 + 0.25 * 0.25);
  const double before = run.transitions[0].x_minus(6);
  EXPECT_NEAR((1 - 1.5 * sine) * before, run.transitions[0].x_plus(6), 1e-10);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  Vector w = ProjectAdmissible(*system, start, run.arcs[0].mode, Vector::LinSpaced(8, 0.3, 1));
  ExpectConfirmedInPlane(*system, start, 0, 0.5, B, w);
}

/// Dropped flat it lands on both corners at once, and stays, or bounces.
TEST(FlatBox, IsDroppedFlat) {
  for (const double restitution : {0.0, 0.4}) {
    const auto system = MakeSystem<test::FlatBox>({{"restitution", restitution}});
    Vector x = StandingInPlane(1);
    x(1) += 0.1;
    const double falls = std::sqrt(2 * 0.1 / kGravity), speed = kGravity * falls;
    const Trajectory run = Simulate(*system, x, Vector::Zero(1), falls + 0.05, TightAtSize());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size());
    EXPECT_EQ(restitution > 0 ? "oo" : "ss", run.arcs[1].mode.Word(2));
    EXPECT_NEAR(falls, run.transitions[0].t, 1e-11);
    EXPECT_NEAR(restitution * speed, run.transitions[0].x_plus(5), 1e-10);
    EXPECT_NEAR((1 + restitution) * speed, run.transitions[0].impulse(0), 1e-10);
    EXPECT_NEAR(0, run.FinalState()(2), 1e-12);
    const BDerivative B = DifferentiateOutcome(*system, run);
    EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome) << B.status.message;
  }
}

}  // namespace
}  // namespace contact_flow
