// SPDX-License-Identifier: BSD-3-Clause
// Landings with friction that a run merges although they are not quite simultaneous.
#include "contact_flow/derivative/cluster_reading.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Two bodies fall at unit speed onto plastic floors that press them, with friction against the
/// coordinates r and s, and push a third while both fly: z̈ = c ẋ ẏ, so that ż(T) = c m with the
/// time m of the first landing.
struct FlyingWithFriction : test::UnitMasses<5, 2> {
  static constexpr const char* kName = "flying_with_friction";
  static constexpr std::array<const char*, 5> kCoordinates = {"x", "y", "z", "r", "s"};
  static constexpr std::array<const char*, 5> kUnits = {"m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"x_stop", "y_stop"};
  static constexpr int kSlipDimension = 1;
  template <class P>
  struct Parameters {
    P c = 3;
    P mu = 0.5;
    template <class V>
    void Visit(V&& visit) {
      visit(c, "c", "", "of the push", Range::kAny);
      visit(mu, "mu", "", "friction", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>&,
                    const Eigen::Matrix<S, 5, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 5, 1>* f) {
    (*f)(0) = (*f)(1) = S(-1.0);
    (*f)(2) = p.c * v(0) * v(1);
    (*f)(3) = (*f)(4) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 5, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1);
  }
  template <class P, class S>
  static void Slip(const P&, const Eigen::Matrix<S, 5, 1>&, const Eigen::Matrix<S, 5, 1>& v,
                   Eigen::Matrix<S, 2, 1>* slip) {
    (*slip)(0) = v(3);
    (*slip)(1) = v(4);
  }
  template <class P>
  static auto Friction(const Parameters<P>& p, int) {
    return p.mu;
  }
};

TEST(ClusterReadingWithFriction, SaysFromWhereOnItHolds) {
  constexpr double kHeight = 0.5, kApart = 9e-8, kDuration = 1;
  const auto system = test::Make<FlyingWithFriction>({});
  Vector x = Vector::Zero(10);
  x << kHeight, kHeight + kApart, 0, 0, 0, -1, -1, 0, 0.3, -0.2;
  SimulateOptions options;
  options.simultaneity_tolerance = 1e-6;
  const Trajectory run = Simulate(system, x, Vector(0), kDuration, options);
  ASSERT_GE(run.transitions.size(), 1u);
  ASSERT_EQ(ConstraintSet({0, 1}), run.transitions[0].activated);
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  // x is delayed by α over its speed, as y is ahead of it by kApart over the same.
  const Vector later = Vector::Unit(10, 0);
  const ClusterReading reading = ReadClusters(B, later);
  EXPECT_NEAR(kApart, reading.inner_radius, 1e-3 * kApart);
  EXPECT_FALSE(reading.in_order.allFinite());
  EXPECT_EQ(0, ReadClusters(B, -later).inner_radius);
  // Runs far inside and outside: ż(T) changes as the first landing does.
  SimulateOptions exact;
  exact.relative_tolerance = exact.absolute_tolerance = 1e-13;
  exact.simultaneity_tolerance = 1e-14;
  const double base = Simulate(system, x, Vector(0), kDuration, exact).FinalState()(7);
  const auto quotient = [&](double alpha) {
    const Trajectory moved = Simulate(system, x + alpha * later, Vector(0), kDuration, exact);
    return (moved.FinalState()(7) - base) / alpha;
  };
  EXPECT_NEAR(0, B(later)(7), 1e-5);
  EXPECT_GT(quotient(0.5 * kApart), 1);
  EXPECT_NEAR(B(later)(7), quotient(1e4 * kApart), 1e-3);
}

}  // namespace
}  // namespace contact_flow
