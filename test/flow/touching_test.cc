// SPDX-License-Identifier: BSD-3-Clause
// Contacts that rest or touch when others are hit or let go.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// A ball (γ = 0.5) falls on a box at rest on a floor (γ = 0.3).
TEST(RestingContacts, APushIsNoBounce) {
  const auto system = LoadRobot(CONTACT_FLOW_TEST_DATA "/box.yaml");
  const double duration = 0.4, fall = std::sqrt(2 * 0.5 / 9.81), speed = 9.81 * fall;
  const Trajectory run = Simulate(*system, system->nominal().x, Vector(0), duration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(ContactMode({0}), run.transitions[0].mode_after) << "the box rests on";
  EXPECT_TRUE(run.warnings.empty());
  // The impulse goes through the box into the floor: the ball comes back with half its speed.
  // Parabolas are integrated to rounding; the event is located to 1e-14 s.
  const int ball = system->description().coordinates[0] == "ball_z" ? 0 : 1;
  const double left = duration - fall;
  EXPECT_NEAR(0.5 * speed * left - 0.5 * 9.81 * left * left, run.FinalState()(ball), 1e-12);
  EXPECT_NEAR(0.5 * speed - 9.81 * left, run.FinalState()(2 + ball), 1e-12);
  EXPECT_EQ(0, run.FinalState()(1 - ball));
}

/// Two contacts with G_12 = −0.6, whose forces in the mode of both are ρ_i (1 − clock).
struct LettingGo : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "letting_go";
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  template <class P>
  struct Parameters {
    P rate_1 = 1, rate_2 = 0.3;
    template <class V>
    void Visit(V&& visit) {
      visit(rate_1, "rate_1", "N/s", "-dλ/dt of the first contact", Range::kAny);
      visit(rate_2, "rate_2", "N/s", "-dλ/dt of the second contact", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    const S left = 1.0 - q(2);
    (*f)(0) = -(p.rate_1 - 0.6 * p.rate_2) * left;
    (*f)(1) = -0.8 * p.rate_2 * left;
    (*f)(2) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = -0.6 * q(0) + 0.8 * q(1);
  }
};

/// With c = −G dλ/dt = (ρ₁ − 0.6 ρ₂, ρ₂ − 0.6 ρ₁), the rates z after it solve 0 ≤ z ⟂ G z + c ≥ 0:
/// the second holds with z₂ = 0.6 ρ₁ − ρ₂ iff that is positive, and the first then opens like
/// 0.64 ρ₁ t³/6; else both let go.
TEST(Releases, ForcesThatVanishAtOnceAreDecidedTogether) {
  for (const double rate_2 : {0.3, 0.55, 0.65, 1.0, 1.6, 3.0}) {
    const auto system = test::Make<LettingGo>({{"rate_2", rate_2}});
    Vector x = Vector::Zero(6);
    x(5) = 1;
    const Trajectory run = Simulate(system, x, Vector(0), 2);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size()) << rate_2;
    EXPECT_NEAR(1, run.transitions[0].t, 1e-9);
    const bool first = 0.6 * rate_2 > 1, second = 0.6 > rate_2;
    ContactMode held;
    if (first) held.Insert(0);
    if (second) held.Insert(1);
    EXPECT_EQ(held, run.transitions[0].mode_after) << rate_2;
    // Gaps after one second: of the free one alone, or c/6 of both.
    const double gap_1 = (first ? 0 : second ? 0.64 : 1 - 0.6 * rate_2) / 6;
    const double gap_2 = (second ? 0 : first ? 0.64 * rate_2 : rate_2 - 0.6) / 6;
    const Vector end = run.FinalState();
    EXPECT_NEAR(gap_1, end(0), 1e-8) << rate_2;
    EXPECT_NEAR(gap_2, -0.6 * end(0) + 0.8 * end(1), 1e-8) << rate_2;
  }
}

/// A mass over a floor, on a lift that fades.
struct FadingLift : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "fading_lift";
  static constexpr std::array<const char*, 2> kCoordinates = {"z", "clock"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P lift = 6e-3, fade = 2e4;
    template <class V>
    void Visit(V&& visit) {
      visit(lift, "lift", "N", "force at the beginning", Range::kAny);
      visit(fade, "fade", "N/s", "what it loses in time", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = p.lift - p.fade * q(1);
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

/// z = lift t²/2 − fade t³/6: it is back after 3 lift/fade, having risen by less than can be told.
TEST(Releases, WhatHardlyRisesComesBackWhereItBegan) {
  const auto system = test::Make<FadingLift>({});
  Vector x = Vector::Zero(4);
  x(3) = 1;
  const Trajectory run = Simulate(system, x, Vector(0), 1e-2);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_NEAR(3 * 6e-3 / 2e4, run.transitions[0].t, 1e-9);
  EXPECT_EQ(ContactMode({0}), run.transitions[0].mode_after);
  EXPECT_NEAR(0, run.FinalState()(0), 1e-14);
}

/// Three equal balls in a row on a line; the last two may be pressed together.
struct Row : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "row";
  static constexpr std::array<const char*, 3> kCoordinates = {"x1", "x2", "x3"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first_pair", "second_pair"};
  template <class P>
  struct Parameters {
    P restitution = 0, press = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(restitution, "restitution", "", "of both pairs", Range::kUnitInterval);
      visit(press, "press", "N", "force that presses the last two together", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(0.0) + p.press;
    (*f)(2) = S(0.0) - p.press;
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1) - q(0);
    (*a)(1) = q(2) - q(1);
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
};

Vector RowAtRest() {
  Vector x = Vector::Zero(6);
  x(0) = -0.5;
  x(3) = 1;
  return x;
}

TEST(TouchingContacts, PlasticBallsInARowMoveOnTogether) {
  for (const double press : {0.0, 1e-8, 1.0}) {
    const auto system = test::Make<Row>({{"press", press}});
    const Trajectory run = Simulate(system, RowAtRest(), Vector(0), 1);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size()) << press;
    // Momentum 1 over mass 3.
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(1.0 / 3, run.FinalState()(3 + i), 1e-13) << press;
    EXPECT_EQ(press == 0 ? ConstraintSet({1}) : ConstraintSet(), run.transitions[0].touching);
  }
}

TEST(TouchingContacts, TheCradleFollowsOneLawTouchingOrPressed) {
  for (const double press : {0.0, 1e-8, 1e-3}) {
    const auto system = test::Make<Row>({{"press", press}, {"restitution", 1}});
    const Trajectory run = Simulate(system, RowAtRest(), Vector(0), 0.6);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size()) << press;
    // Da v⁺ = (1, 0) = −Da v⁻ and momentum 1: one solution.
    const Vector v = run.transitions[0].x_plus.tail(3);
    EXPECT_LE((v - Eigen::Vector3d(-1.0 / 3, 2.0 / 3, 2.0 / 3)).norm(), 1e-13) << press;
    if (press > 0) continue;
    EXPECT_EQ(ConstraintSet({1}), run.transitions[0].touching);
    ASSERT_EQ(1, run.num_warnings);
    EXPECT_EQ(Outcome::kDiscontinuous, run.warnings[0].code);
    EXPECT_NE(std::string::npos, run.warnings[0].message.find("second_pair"));
    EXPECT_NE(std::string::npos, run.warnings[0].message.find("not continuous"));
  }
}

/// A plate on four corners (z, roll, pitch; a_i = z ± roll ± pitch, M = I): rows of rank 3. Its
/// weight g = 10 acts at (reach cos t, reach sin t).
struct FourCorners : test::UnitMasses<4, 4> {
  static constexpr const char* kName = "four_corners";
  static constexpr std::array<const char*, 4> kCoordinates = {"z", "roll", "pitch", "clock"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "rad", "rad", "s"};
  static constexpr std::array<const char*, 4> kConstraintNames = {"pp", "pm", "mp", "mm"};
  template <class P>
  struct Parameters {
    P reach = 0, lean = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(reach, "reach", "m", "of the circle of the weight", Range::kAny);
      visit(lean, "lean", "m/s", "speed of the weight along the first axis", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    using std::cos;
    using std::sin;
    (*f)(0) = S(-10.0);
    (*f)(1) = -10.0 * (p.reach * cos(q(3)) + p.lean * q(3));
    (*f)(2) = -10.0 * p.reach * sin(q(3));
    (*f)(3) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 4, 1>& q, Eigen::Matrix<S, 4, 1>* a) {
    (*a)(0) = q(0) + q(1) + q(2);
    (*a)(1) = q(0) + q(1) - q(2);
    (*a)(2) = q(0) - q(1) + q(2);
    (*a)(3) = q(0) - q(1) - q(2);
  }
};

/// Falls flat, 0.2 m, and stands while its weight goes round inside the square of its corners.
TEST(DependentContacts, APlateStandsOnFourCorners) {
  for (const double reach : {0.0, 0.3, 0.9}) {
    const auto system = test::Make<FourCorners>({{"reach", reach}});
    for (const double height : {0.0, 0.2}) {
      Vector x = Vector::Zero(8);
      x(0) = height;
      x(7) = 1;
      if (height > 0 && reach > 0) continue;  // it would turn while it falls
      const Trajectory run = Simulate(system, x, Vector(0), 20);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      // A held contact is integrated with ä = 0 up to rounding, 1e-15 · 10 m/s²: 2e-12 m after
      // 20 s; support changes are located to the floor of the search.
      EXPECT_LE(run.FinalState().head(3).cwiseAbs().maxCoeff(), 1e-8) << reach;
      EXPECT_EQ(3, run.arcs.back().mode.Size());
      if (height == 0) continue;
      const BDerivative B = DifferentiateOutcome(system, run);
      EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome);
      EXPECT_NE(std::string::npos, B.status.message.find("Assumption 3")) << B.status.message;
    }
  }
}

/// The weight leaves the square at t = 2 s over the edge {mp, mm} … where λ of the other edge
/// vanishes: (1 − 0.5 t)/4 g each.
TEST(DependentContacts, APlateTipsOverItsEdge) {
  const auto system = test::Make<FourCorners>({{"lean", 0.5}});
  Vector x = Vector::Zero(8);
  x(7) = 1;
  const Trajectory run = Simulate(system, x, Vector(0), 3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  // About the edge z + roll = 0 the acceleration r of roll, −r of z, is 2 r = −10 · 0.5 (t − 2):
  // roll = −2.5/6 after a second, found with the release at 1e-9 s.
  EXPECT_NEAR(-2.5 / 6, run.FinalState()(1), 1e-7);
  EXPECT_NEAR(2.5 / 6, run.FinalState()(0), 1e-7);
  EXPECT_NEAR(0, run.FinalState()(2), 1e-9);
}

}  // namespace
}  // namespace contact_flow
