// SPDX-License-Identifier: BSD-3-Clause
// A box in space that stands on four corners: twelve rows that stick and six freedoms.
#include "test/friction/systems/space_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/confirmed.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;
using test::Tight;

Vector StandingInSpace(double height = 1) {
  Vector x = Vector::Zero(15);
  x(2) = 0.5 * height;
  x(3) = x(14) = 1;
  return x;
}

/// Standing on its front edge, x = l/2 ahead of it, pitched by `pitch` about it at `rate`.
Vector TiltedInSpace(double length, double height, double pitch, double rate) {
  const double c = std::cos(pitch), s = std::sin(pitch);
  const double across = -0.5 * length * c + 0.5 * height * s,
               up = 0.5 * height * c + 0.5 * length * s;
  Vector x = Vector::Zero(15);
  x(0) = across;
  x(2) = up;
  x(3) = std::cos(0.5 * pitch);
  x(5) = std::sin(0.5 * pitch);
  x(8) = up * rate;
  x(10) = -across * rate;
  x(12) = rate;
  x(14) = 1;
  return x;
}

void ExpectConfirmedInSpace(const MechanicalSystem& system, const Vector& x, double duration,
                            const BDerivative& B, const Vector& w, double alpha = 1e-3) {
  const QuotientReport report = CompareWithQuotients(system, x, Vector::Zero(3), duration, w, B(w),
                                                     {alpha, 0.1 * alpha, 0.01 * alpha}, Tight());
  test::ExpectConfirmed(report, B, w);
}

TEST(SpaceBox, Stands) {
  const auto system = MakeSystem<test::SpaceBox>({});
  const Trajectory run = Simulate(*system, StandingInSpace(), Vector::Zero(3), 1, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_EQ("ssss", run.arcs[0].mode.Word(4));
  ContactDynamics dynamics(*system, Vector::Zero(3));
  dynamics.Evaluate(run.FinalState(), run.arcs[0].mode);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(0.5 * kGravity, dynamics.force()(i), 1e-11);
  EXPECT_NEAR(0, dynamics.force().tail(8).norm(), 1e-11);
  EXPECT_EQ(4, dynamics.shared().Size());
  EXPECT_LT(run.FinalState().segment(8, 6).norm(), 1e-12);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
}

/// F = rate t in x turns it over its front edge when F arm = m g l/2.
TEST(SpaceBox, TipsOverAnEdge) {
  const auto system = MakeSystem<test::SpaceBox>({{"rate_x", 4}});
  const double tips = 2 * kGravity * 0.25 / 0.8 / 4;
  const Trajectory run = Simulate(*system, StandingInSpace(), Vector::Zero(3), tips + 0.2, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("osos", run.arcs[1].mode.Word(4));
  EXPECT_NEAR(tips, run.transitions[0].t, 1e-10);
  EXPECT_GT(run.FinalState()(5), 1e-3);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  ExpectConfirmedInSpace(*system, StandingInSpace(), tips + 0.2, B, Vector::Unit(14, 6));
}

/// Falls back on its rear edge from its front edge: two corners land where two others hold.
TEST(SpaceBox, LandsFlat) {
  const auto system = MakeSystem<test::SpaceBox>({{"length", 1.6}});
  const Vector start = TiltedInSpace(1.6, 1, 0.02, 0.8);
  const Trajectory run = Simulate(*system, start, Vector::Zero(3), 0.5, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("osos", run.arcs[0].mode.Word(4));
  EXPECT_EQ("ssss", run.arcs[1].mode.Word(4));
  EXPECT_LT(run.FinalState().segment(8, 6).norm(), 1e-12);
  EXPECT_NEAR(0, run.FinalState()(5), 1e-11);
  EXPECT_LT(run.transitions[0].energy_change, 0);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  // Tilted further, and turning faster, about the same edge.
  const Vector w = (system->Separation(TiltedInSpace(1.6, 1, 0.02 + 1e-5, 0.8 + 2e-5), start) -
                    system->Separation(TiltedInSpace(1.6, 1, 0.02 - 1e-5, 0.8 - 2e-5), start)) /
                   2e-5;
  ExpectConfirmedInSpace(*system, start, 0.5, B, w, 1e-2);
}

/// Dropped flat it lands on four corners at once.
TEST(SpaceBox, IsDroppedFlat) {
  for (const double restitution : {0.0, 0.4}) {
    const auto system = MakeSystem<test::SpaceBox>({{"restitution", restitution}});
    Vector x = StandingInSpace();
    x(2) += 0.1;
    const double falls = std::sqrt(2 * 0.1 / kGravity), speed = kGravity * falls;
    const Trajectory run = Simulate(*system, x, Vector::Zero(3), falls + 0.05, Tight());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size());
    EXPECT_EQ(restitution > 0 ? "oooo" : "ssss", run.arcs[1].mode.Word(4));
    EXPECT_NEAR(falls, run.transitions[0].t, 1e-11);
    EXPECT_NEAR(restitution * speed, run.transitions[0].x_plus(10), 1e-10);
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(0.5 * (1 + restitution) * speed, run.transitions[0].impulse(i), 1e-10);
    }
    EXPECT_FALSE(DifferentiateOutcome(*system, run).status.ok());
  }
}

/// Thrown without spin it slides, and stops on all corners at once, x = v²/(2 μ g).
TEST(SpaceBox, SlidesAndStops) {
  const auto system = MakeSystem<test::SpaceBox>({{"friction", 0.3}});
  Vector x = StandingInSpace();
  x(8) = 0.8;
  x(9) = -0.6;
  const double stops = 1 / (0.3 * kGravity);
  const Trajectory run = Simulate(*system, x, Vector::Zero(3), stops + 0.3, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("llll", run.arcs[0].mode.Word(4));
  EXPECT_EQ("ssss", run.arcs[1].mode.Word(4));
  EXPECT_NEAR(0.5 * stops * 0.8, run.FinalState()(0), 1e-9);
  EXPECT_NEAR(-0.5 * stops * 0.6, run.FinalState()(1), 1e-9);
  EXPECT_EQ(Outcome::kNotDifferentiable, DifferentiateOutcome(*system, run).status.outcome);
  x(13) = 0.1;  // it turns: how its weight is shared decides (turning_face_test)
  const Trajectory turning = Simulate(*system, x, Vector::Zero(3), 0.1, Tight());
  EXPECT_TRUE(turning.status.ok()) << turning.status.message;
  ASSERT_FALSE(turning.warnings.empty());
  EXPECT_EQ(Outcome::kIndeterminateForces, turning.warnings[0].code);
}

/// Set down under a push that its friction does not hold: it slides along it at once.
TEST(SpaceBox, SlidesFromRest) {
  const auto system = MakeSystem<test::SpaceBox>({{"friction", 0.2}});
  Vector push = Vector::Zero(3);
  push.head(2) << 3, 3;
  const Trajectory run = Simulate(*system, StandingInSpace(), push, 0.3, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_EQ("llll", run.arcs[0].mode.Word(4));
  const double speed = 0.3 * (push.norm() / 2 - 0.2 * kGravity);
  const Vector v = run.FinalState().segment(8, 6), x = run.FinalState() - StandingInSpace();
  for (const int axis : {0, 1}) {
    EXPECT_NEAR(speed * std::sqrt(0.5), v(axis), 1e-9);
    EXPECT_NEAR(speed * std::sqrt(0.5) * 0.15, x(axis), 1e-9);
  }
  EXPECT_LT(v.tail(4).norm(), 1e-9);
}

/// Pushed along x until it leaves its cone, it slides without turning: F = μ m g. The direction of
/// such a small slip is stiff, so that a short part is enough.
TEST(SpaceBox, BeginsToSlide) {
  const auto system = MakeSystem<test::SpaceBox>({{"rate_x", 4}, {"friction", 0.2}});
  const double slips = 0.2 * 2 * kGravity / 4;
  const Trajectory run =
      Simulate(*system, StandingInSpace(), Vector::Zero(3), slips + 1e-10, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(2u, run.arcs.size());
  EXPECT_EQ("llll", run.arcs[1].mode.Word(4));
  EXPECT_NEAR(slips, run.transitions[0].t, 1e-10);
  const Vector v = run.FinalState().segment(8, 6);
  EXPECT_GT(v(0), 0);
  // It begins with ten absolute tolerances, 1e-11 m/s, beside which rounding of 1e-16 is 1e-5.
  EXPECT_LT(v.tail(5).norm(), 1e-5 * v(0));
}

/// Let go on one corner while it slides it clatters, and slides on: bounces without end are
/// completed to sticking, which costs next to nothing.
TEST(SpaceBox, ClattersAndSlides) {
  const auto system = MakeSystem<test::SpaceBox>({{"height", 0.3}});
  int completed = 0;
  for (int k = 0; k < 16; ++k) {
    const double axis = 0.2 + 0.7 * k;
    Vector x = Vector::Zero(15);
    x.segment(3, 4) << std::cos(0.1), std::cos(axis) * std::sin(0.1),
        std::sin(axis) * std::sin(0.1), 0;
    x(8) = 0.3;
    x(14) = 1;
    ConstraintTerms terms;
    system->Constraints(x.head(8), x.tail(7), &terms);
    x(2) -= terms.gap.minCoeff();
    const Trajectory run = Simulate(*system, x, Vector::Zero(3), 1.5);
    ASSERT_TRUE(run.status.ok()) << axis << ": " << run.status.message;
    EXPECT_LT(run.FinalState().segment(8, 6).norm(), 1e-8) << axis;
    EXPECT_NEAR(0.15, run.FinalState()(2), 1e-8) << axis;
    double lost = 0;
    for (const Transition& transition : run.transitions) lost += transition.energy_lost;
    EXPECT_LT(std::abs(lost), 1e-6) << axis;  // of 0.5 J
    const auto& told = run.warnings;
    const bool completes = std::any_of(told.begin(), told.end(), [](const Warning& warning) {
      return warning.code == Outcome::kZeno;
    });
    if (!completes) continue;
    ++completed;
    EXPECT_FALSE(DifferentiateOutcome(*system, run).status.ok()) << axis;
  }
  EXPECT_GE(completed, 1);
}

}  // namespace
}  // namespace contact_flow
