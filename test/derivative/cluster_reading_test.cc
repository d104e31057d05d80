// SPDX-License-Identifier: BSD-3-Clause
// Events that were merged although they are not quite simultaneous.
#include "contact_flow/derivative/cluster_reading.h"

#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Two bodies fly at unit speed onto plastic stops, and push a third while both fly: z̈ = c ẋ ẏ.
/// With m = min(x₀, y₀) the time of the first impact, ż(T) = c m and z(T) = c (m T − m²/2).
struct Flying : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "flying";
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "z"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"x_stop", "y_stop"};
  template <class P>
  struct Parameters {
    P c = 3;
    template <class V>
    void Visit(V&& visit) {
      visit(c, "c", "", "of the push", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(1) = S(0.0);
    (*f)(2) = p.c * v(0) * v(1);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1);
  }
};

constexpr double kDuration = 1, kFirst = 0.5, kApart = 9e-8, kPush = 3;

Vector FlyingStart(double alpha = 0) {
  Vector x = Vector::Zero(6);
  x << kFirst + alpha, kFirst + kApart, 0, -1, -1, 0;
  return x;
}

struct Differentiated {
  explicit Differentiated(double tolerance) : system(test::Make<Flying>({})) {
    SimulateOptions options;
    options.simultaneity_tolerance = tolerance;
    run = Simulate(system, FlyingStart(), Vector(0), kDuration, options);
    B = DifferentiateOutcome(system, run);
  }
  ClusterReading Read(const Vector& w) const { return ReadClusters(B, w); }
  ModelSystem<Flying> system;
  Trajectory run;
  BDerivative B;
};

/// (ż, z) of the run from x₀ + α, by closed form, over α.
double Quotient(double alpha) {
  return kPush * (std::min(kFirst + alpha, kFirst + kApart) - kFirst) / alpha;
}

TEST(ClusterReading, OfEventsThatAWideToleranceMerged) {
  const Differentiated merged(1e-6);
  ASSERT_EQ(1u, merged.run.transitions.size());
  ASSERT_TRUE(merged.B.status.ok()) << merged.B.status.message;
  const Vector later = Vector::Unit(6, 0);
  const ClusterReading reading = merged.Read(later);
  // x is delayed: as a cluster y comes first, and x's delay does not matter; in order, x does.
  // Both are matrices with entries of size 1 at ρ, which is off by kApart.
  EXPECT_NEAR(0, merged.B(later)(5), 1e-6);
  EXPECT_NEAR(kPush, reading.in_order(5), 1e-6);
  EXPECT_NEAR(kPush * (kDuration - kFirst), reading.in_order(2), 1e-6);
  // The instants are known to the rounding of positions, 1e-16.
  EXPECT_NEAR(kApart, reading.inner_radius, 1e-14);
  // Runs inside and outside.
  SimulateOptions exact;
  exact.relative_tolerance = exact.absolute_tolerance = 1e-13;
  exact.simultaneity_tolerance = 1e-14;
  const Trajectory base = Simulate(merged.system, FlyingStart(), Vector(0), kDuration, exact);
  for (double part : {0.1, 0.9, 10.0, 1000.0}) {
    const double alpha = part * reading.inner_radius;
    const Trajectory run = Simulate(merged.system, FlyingStart(alpha), Vector(0), kDuration, exact);
    const double quotient = (run.FinalState()(5) - base.FinalState()(5)) / alpha;
    // Rounding of ż over α.
    EXPECT_NEAR(Quotient(alpha), quotient, 1e-15 / alpha + 1e-6) << part;
    const double predicted = part < 1 ? reading.in_order(5) : merged.B(later)(5);
    EXPECT_NEAR(predicted, quotient, part < 1 ? 1e-6 : 1.1 * kPush / part) << part;
  }
}

TEST(ClusterReading, IsTheSameWhereTheDirectionKeepsTheOrder) {
  const Differentiated merged(1e-6);
  const Vector sooner = -Vector::Unit(6, 0);
  const ClusterReading reading = merged.Read(sooner);
  EXPECT_EQ(0, reading.inner_radius);
  EXPECT_NEAR(-kPush, reading.in_order(5), 1e-6);
  EXPECT_LE((reading.in_order - merged.B(sooner)).norm(), 1e-12);
}

TEST(ClusterReading, TheDefaultToleranceTellsTheOrder) {
  const Differentiated told(0);
  ASSERT_EQ(2u, told.run.transitions.size());
  ASSERT_TRUE(told.B.status.ok()) << told.B.status.message;
  const Vector later = Vector::Unit(6, 0);
  // Polynomials: rounding, over the time between the events in the saltation matrices.
  EXPECT_NEAR(kPush, told.B(later)(5), 1e-9);
  EXPECT_NEAR(kPush * (kDuration - kFirst), told.B(later)(2), 1e-9);
  const ClusterReading reading = told.Read(later);
  EXPECT_EQ(0, reading.inner_radius);
  EXPECT_LE((reading.in_order - told.B(later)).norm(), 1e-12);
}

/// Three bodies land at t, t + a and t + 10 a. Delayed by 2 α, 3 α and α they come in the order of
/// the delays once the last is the first: at α = 10 a, and not where it passes the second, 4.5 a.
struct ThreeFlying : test::UnitMasses<4, 3> {
  static constexpr const char* kName = "three_flying";
  static constexpr std::array<const char*, 4> kCoordinates = {"x", "y", "u", "z"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"x_stop", "y_stop", "u_stop"};
  template <class P>
  struct Parameters {
    P c = 3;
    template <class V>
    void Visit(V&& visit) {
      visit(c, "c", "", "of the push", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                    const Eigen::Matrix<S, 4, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    (*f)(0) = (*f)(1) = (*f)(2) = S(0.0);
    (*f)(3) = p.c * v(0) * v(1) * v(2);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 4, 1>& q, Eigen::Matrix<S, 3, 1>* a) {
    for (int i = 0; i < 3; ++i) (*a)(i) = q(i);
  }
};

TEST(ClusterReading, LooksAtAllPairs) {
  const auto system = test::Make<ThreeFlying>({});
  Vector x = Vector::Zero(8), w = Vector::Zero(8);
  x << kFirst, kFirst + kApart, kFirst + 10 * kApart, 0, -1, -1, -1, 0;
  w.head(3) << 2, 3, 1;
  const auto run = [&](double alpha, double tolerance) {
    SimulateOptions options;
    options.simultaneity_tolerance = tolerance;
    return Simulate(system, x + alpha * w, Vector(0), kDuration, options);
  };
  const Trajectory merged = run(0, 1e-5);
  ASSERT_EQ(1u, merged.transitions.size());
  const BDerivative B = DifferentiateOutcome(system, merged);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const double radius = ReadClusters(B, w).inner_radius;
  EXPECT_NEAR(10 * kApart, radius, 1e-13);
  // ż(T) = −c min(x, y, u), whose slope is that of u from there on.
  EXPECT_NEAR(-kPush * 1, B(w)(7), 1e-5);
  const double before = run(0.9 * radius, 1e-12).FinalState()(7),
               behind = run(1.1 * radius, 1e-12).FinalState()(7),
               far = run(2 * radius, 1e-12).FinalState()(7);
  EXPECT_NEAR(-kPush * 2, (before - run(0, 1e-12).FinalState()(7)) / (0.9 * radius), 1e-6);
  EXPECT_NEAR(B(w)(7), (far - behind) / (0.9 * radius), 1e-5);
}

/// At one instant as far as it is known: which comes first is not, in neither direction.
TEST(ClusterReading, OfAnOrderThatIsNotKnown) {
  const auto system = test::Make<Flying>({});
  Vector x = FlyingStart();
  x(1) = x(0);
  const Trajectory run = Simulate(system, x, Vector(0), kDuration);
  ASSERT_EQ(1u, run.transitions.size());
  const BDerivative B = DifferentiateOutcome(system, run);
  for (const double sign : {1.0, -1.0}) {
    const double radius = ReadClusters(B, sign * Vector::Unit(6, 0)).inner_radius;
    EXPECT_GT(radius, 0) << sign;
    EXPECT_LT(radius, 1e-13) << sign;  // errors of the instants are rounding
  }
  // Both change places with nothing.
  EXPECT_EQ(0, ReadClusters(B, Vector::Unit(6, 2)).inner_radius);
}

}  // namespace
}  // namespace contact_flow
