// SPDX-License-Identifier: BSD-3-Clause
// What grazes has no sharp instant, but what is far from its zero does not happen with it.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Two balls that share nothing: one is thrown up to a lid at 1 m, one falls onto a floor and also
/// moves along x.
struct TwoBalls : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "two_balls_apart";
  static constexpr std::array<const char*, 3> kCoordinates = {"thrown", "falls", "x"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"lid", "floor"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(1) = S(-10.0);
    (*f)(2) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = 1.0 - q(0);
    (*a)(1) = q(1);
  }
};

struct TwoBallsWithFriction : TwoBalls {
  static constexpr const char* kName = "two_balls_with_friction";
  static constexpr int kSlipDimension = 1;
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = S(0.0) * v(0);
    (*s)(1) = v(2);
  }
  template <class P>
  static P Friction(const Parameters<P>&, int i) {
    return P(i == 1 ? 0.5 : 0.0);
  }
};

/// One is at its apex after √(1/5) s, as it touches the lid with no speed; the other is then at
/// 2 − 1 = 1 m, and falls on. The instant of the graze is uncertain by the root of what heights
/// are uncertain by.
template <class System>
void FallsPastTheGraze(const System& system) {
  for (const double tolerance : {1e-6, 1e-9, 1e-11}) {
    for (int trial = 0; trial < 20; ++trial) {
      Vector x = Vector::Zero(6);
      x(1) = 2;
      x(3) = std::sqrt(20.0) * (1 + (trial - 10) * 1e-2 * tolerance);
      x(5) = 1;
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      const Trajectory run = Simulate(system, x, Vector(0), 0.6, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      // 2 − 5 · 0.36 = 0.2, at −6 m/s: nothing but gravity acts on it.
      EXPECT_NEAR(0.2, run.FinalState()(1), 1e3 * tolerance);
      EXPECT_NEAR(-6, run.FinalState()(4), 1e3 * tolerance);
      EXPECT_NEAR(1, run.FinalState()(5), 1e3 * tolerance);
    }
  }
}

/// A bead slides on a wave, which is there twice, and three balls fall, the last onto the first.
/// The wave's second floor has the rate that integration leaves to the first, which is nothing.
struct BeadAndBalls : test::UnitMasses<5, 5> {
  static constexpr const char* kName = "bead_and_balls";
  static constexpr bool kAffineConstraints = false;
  static constexpr std::array<const char*, 5> kCoordinates = {"x", "z", "first", "second", "third"};
  static constexpr std::array<const char*, 5> kUnits = {"m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 5> kConstraintNames = {"wave", "twin", "first", "second",
                                                                  "third"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 5, 1>&,
                    const Eigen::Matrix<S, 5, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 5, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-30.0);
    (*f)(2) = (*f)(3) = (*f)(4) = S(-10.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 5, 1>& q,
                   Eigen::Matrix<S, 5, 1>* a) {
    using std::sin;
    (*a)(0) = q(1) - 0.1 * sin(3.0 * q(0));
    (*a)(1) = 2.0 * (q(1) - 0.1 * sin(3.0 * q(0)));
    (*a)(2) = q(2);
    (*a)(3) = q(3);
    (*a)(4) = q(4) + 0.1 * q(2);
  }
};

/// The third lands 0.6 s after it is let go from 1.8 m, and not with the second, after 0.4 s.
TEST(Apart, ADriftIsNoTouchdownOfWhatIsHeldTwice) {
  const auto system = test::Make<BeadAndBalls>();
  for (const ImpactLaw law : {ImpactLaw::kComplementarity, ImpactLaw::kProjection}) {
    for (int trial = 0; trial < 40; ++trial) {
      Vector x = Vector::Zero(10);
      x(2) = 0.05 + 0.015 * trial;
      x(3) = 0.8;
      x(4) = 1.8;
      x(5) = 1.5;
      x(6) = 0.3 * x(5);
      SimulateOptions options;
      options.impact_law = law;
      const Trajectory run = Simulate(system, x, Vector(0), 0.7, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      ASSERT_EQ(3u, run.transitions.size()) << "from " << x(2) << " m";
      EXPECT_NEAR(std::sqrt(0.2 * x(2)), run.transitions[0].t, 1e-8);
      EXPECT_EQ(1, run.transitions[0].activated.Size());
      EXPECT_NEAR(0.4, run.transitions[1].t, 1e-8);
      EXPECT_NEAR(0.6, run.transitions[2].t, 1e-8);
    }
  }
}

TEST(Apart, WhatFallsIsNotStoppedByAGrazeElsewhere) { FallsPastTheGraze(test::Make<TwoBalls>()); }

TEST(Apart, NorWithFriction) { FallsPastTheGraze(test::Make<TwoBallsWithFriction>()); }

}  // namespace
}  // namespace contact_flow
