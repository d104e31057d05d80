// SPDX-License-Identifier: BSD-3-Clause
// First returns of a ball in closed form: two crossings within one part of a step, crossings right
// behind the start, and those at the instant of a touchdown.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/model/model_library.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

constexpr double kFall = 10;  // m/s²

PoincareReturn ReturnOfBall(double gravity, const Section& section, const Vector& x) {
  const auto ball = MakeModel("bouncing_ball", {{"gravity", gravity}, {"restitution", 1}});
  return PoincareMap(*ball, Vector(0), section).Return(x);
}

TEST(SectionCrossing, RightBelowAnApexIsSeen) {
  using Kind = Section::Kind;
  Vector x(4);
  for (const double up : {1.0, 2.5, 4.0}) {
    for (const double part : {0.3, 1e-2, 1e-4, 1e-6, 1e-8}) {
      x << 0, 1, 0, up;
      const double rise = up * up / (2 * kFall), height = 1 + rise * (1 - part);
      const double first = up / kFall * (1 - std::sqrt(part));
      const double second = up / kFall * (1 + std::sqrt(part));
      for (const int sign : {1, 0, -1}) {
        const PoincareReturn one = ReturnOfBall(kFall, {Kind::kCoordinate, 1, height, sign}, x);
        ASSERT_EQ(ReturnStatus::kReturned, one.status) << one.message;
        // The speed there is √(2 g depth): what rounding of heights leaves of the time.
        EXPECT_NEAR(sign < 0 ? second : first, one.time, 1e-14 / std::sqrt(part))
            << up << " " << part << " " << sign;
      }
    }
  }
}

TEST(SectionCrossing, RightBehindTheStartIsSeen) {
  using Kind = Section::Kind;
  Vector x(4);
  for (const double t : {0.0011, 0.002, 0.01, 0.03, 0.06}) {
    x << 0, 5, 0.1, 0.2;
    const PoincareReturn place = ReturnOfBall(kFall, {Kind::kCoordinate, 0, 0.1 * t, 1}, x);
    ASSERT_TRUE(place.returned()) << place.message;
    EXPECT_NEAR(t, place.time, 1e-13);
    x(3) = kFall * t;
    const PoincareReturn apex = ReturnOfBall(kFall, {Kind::kVelocity, 1, 0, -1}, x);
    ASSERT_TRUE(apex.returned()) << apex.message;
    EXPECT_NEAR(t, apex.time, 1e-13);
  }
}

/// A coordinate that does not jump passes its section at the instant of a touchdown: there the
/// return is, though it has no derivative, and not later.
TEST(SectionCrossing, AtTheInstantOfATouchdownIsSeen) {
  using Kind = Section::Kind;
  Vector x(4);
  for (const double gravity : {3.7, 9.81, 10.0, 2.0}) {
    for (const double height : {1.0, 0.5, 3.0}) {
      for (int tenths = 1; tenths < 30; ++tenths) {
        const double speed = tenths / 10.0, t = 3 * std::sqrt(2 * height / gravity);
        x << 0, height, speed, 0;
        const PoincareReturn one = ReturnOfBall(gravity, {Kind::kCoordinate, 0, speed * t, 1}, x);
        EXPECT_EQ(ReturnStatus::kNoDerivative, one.status) << one.message;
        EXPECT_NEAR(t, one.time, 1e-9) << gravity << " " << height << " " << speed;
      }
    }
  }
}

/// Behind a plastic impact with a little restitution the contact rises, and rests only later: by
/// the restitution the state right behind the impact has no derivative that holds the contact.
TEST(SectionCrossing, RestitutionOfAPlasticSectionIsRefused) {
  const auto ball = MakeModel("bouncing_ball", {{"gravity", kFall}, {"restitution", 0}});
  Vector x(4);
  x << 0, 5, 1, 0;
  const auto behind = [&](const std::string& parameter) {
    PoincareOptions options;
    options.derivative.variables.parameters = ParameterIndices(ball->description(), {parameter});
    return PoincareMap(*ball, Vector(0), Section::Event(*ball, "floor"), options).Return(x);
  };
  const PoincareReturn refused = behind("restitution");
  EXPECT_EQ(ReturnStatus::kNoDerivative, refused.status);
  EXPECT_NE(std::string::npos, refused.message.find("restitution of 'floor' is 0"))
      << refused.message;
  const PoincareReturn by_gravity = behind("gravity");
  ASSERT_EQ(ReturnStatus::kReturned, by_gravity.status) << by_gravity.message;
  EXPECT_NEAR(-0.05, by_gravity.return_time(Vector::Unit(5, 4))(0), 1e-10);  // T = √(2 z/g)
}

/// Oscillators about y₁ = 1 and y₂ = −1 above floors: the first starts again from its floor, the
/// second stays there.
struct TwoOscillators : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "two_oscillators";
  static constexpr std::array<const char*, 2> kCoordinates = {"y1", "y2"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor1", "floor2"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(1) - q(0);
    (*f)(1) = S(-1) - q(1);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    *a = q;
  }
};

/// A return coincides with an event within the error of that event's instant. Others may be less
/// certain: the first touches at a speed of 1e-3, the second at 2.8 right before the return.
TEST(SectionCrossing, BesideAnEventIsJudgedByTheErrorOfThatOne) {
  const ModelSystem<TwoOscillators> system({});
  const double slow = 1 + 1e-6, quick = 3, when = 2.4;
  const auto returned = [&](double behind) {
    Vector x(4);
    const double one = std::acos(-1 / slow) - 2, two = std::acos(1 / quick) - when;
    x << 1 + slow * std::cos(one), -1 + quick * std::cos(two), -slow * std::sin(one),
        -quick * std::sin(two);
    Section section;
    section.kind = Section::Kind::kTime;
    section.value = when + behind;
    PoincareOptions options;
    options.simulate.relative_tolerance = options.simulate.absolute_tolerance = 1e-7;
    return PoincareMap(system, Vector(0), section, options).Return(x);
  };
  const PoincareReturn beside = returned(1e-6);
  EXPECT_GT(beside.trajectory.simultaneity_tolerance, 2e-6);
  ASSERT_EQ(ReturnStatus::kReturned, beside.status) << beside.message;
  EXPECT_NEAR(0, beside.map(Vector::Unit(4, 1)).norm(), 1e-7);  // it stays on its floor
  EXPECT_EQ(ReturnStatus::kNoDerivative, returned(1e-8).status);
}

}  // namespace
}  // namespace contact_flow
