// SPDX-License-Identifier: BSD-3-Clause
// Systems that share nothing, side by side: each has the derivative that it has alone.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Two balls slide on a floor, each to a wall through its origin that leans back and lifts it.
struct BallsAndWalls : test::UnitMasses<4, 4> {
  static constexpr const char* kName = "balls_and_walls";
  static constexpr std::array<const char*, 4> kCoordinates = {"x1", "z1", "x2", "z2"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 4> kConstraintNames = {"floor 1", "wall 1", "floor 2",
                                                                  "wall 2"};
  template <class P>
  struct Parameters {
    P lean_1 = 0.5, lean_2 = 0.5;
    template <class V>
    void Visit(V&& visit) {
      visit(lean_1, "lean_1", "rad", "of the first wall", Range::kAny);
      visit(lean_2, "lean_2", "rad", "of the second wall", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>&,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    (*f)(0) = (*f)(2) = S(0.0);
    (*f)(1) = (*f)(3) = S(-test::kGravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 4, 1>* a) {
    using std::cos;
    using std::sin;
    const P leans[] = {p.lean_1, p.lean_2};
    for (int i = 0; i < 2; ++i) {
      (*a)(2 * i) = q(2 * i + 1);
      (*a)(2 * i + 1) = S(cos(leans[i])) * q(2 * i) + S(sin(leans[i])) * q(2 * i + 1);
    }
  }
};

/// The balls at 0.16 m from their walls at 0.7 m/s; one that is alone has the other at rest there.
Vector Sliding(bool first, bool second) {
  return test::Entries({0.16, 0, 0.16, 0, first ? -0.7 : 0.0, 0, second ? -0.7 : 0.0, 0});
}

/// Both reach their walls at one instant. A direction that keeps the balls on the floor changes
/// each as if it were alone; which selection has the other lifted off the floor does not matter.
TEST(SideBySide, EachBallHasItsOwnDerivative) {
  constexpr std::array<int, 4> kOfFirst = {0, 1, 4, 5}, kOfSecond = {2, 3, 6, 7};
  for (const double lean : {0.5, 0.3, 0.0}) {
    const auto balls = MakeSystem<BallsAndWalls>({{"lean_2", lean}});
    const auto derivative = [&](bool first, bool second) {
      const Trajectory run =
          Simulate(*balls, Sliding(first, second), Vector(0), 0.26, test::Tight());
      return DifferentiateOutcome(*balls, run);
    };
    const BDerivative both = derivative(true, true);
    const BDerivative first = derivative(true, false), second = derivative(false, true);
    ASSERT_TRUE(both.status.ok()) << lean << ": " << both.status.message;
    ASSERT_TRUE(first.status.ok()) << first.status.message;
    ASSERT_TRUE(second.status.ok()) << second.status.message;
    ASSERT_EQ(2, both.events.front().num_activations());
    for (int trial = 0; trial < 16; ++trial) {
      Vector w = Vector::Zero(8);
      for (const int i : {0, 2, 4, 6}) w(i) = std::sin(7 * trial + 3 * i + 1.0);
      const Vector found = both(w);
      const Vector a = first(w), b = second(w);
      for (const int i : kOfFirst) EXPECT_NEAR(a(i), found(i), 1e-9) << lean << ", " << i;
      for (const int i : kOfSecond) EXPECT_NEAR(b(i), found(i), 1e-9) << lean << ", " << i;
    }
  }
}

}  // namespace
}  // namespace contact_flow
