// SPDX-License-Identifier: BSD-3-Clause
// Two contacts rest, a third is hit, and the impulse on one of the two vanishes together with its
// speed afterwards: what a perturbed impact does is decided by the derivative of the
// complementarity problem.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Walls a_i = q_i for h, a, b and a free coordinate s. M_hb = slope·s vanishes at s = 0, and with
/// it the coupling of h and b that a does not carry: g_hb = g_ha g_ab there. The force on b changes
/// sign as h stops: `pull` > 0 lets b go.
struct Chain : test::UnitMasses<4, 3> {
  static constexpr const char* kName = "chain";
  static constexpr bool kConstantMass = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"h", "a", "b", "s"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"hit", "near", "far"};
  template <class P>
  struct Parameters {
    P first = 0.5, second = 0.5, slope = 1, pull = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(first, "first", "kg", "M_ha", Range::kAny);
      visit(second, "second", "kg", "M_ab", Range::kAny);
      visit(slope, "slope", "kg/m", "of M_hb", Range::kAny);
      visit(pull, "pull", "N", "on b after the impact", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                         Eigen::Matrix<S, 4, 4>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(0, 1) = (*M)(1, 0) = S(p.first);
    (*M)(1, 2) = (*M)(2, 1) = S(p.second);
    (*M)(0, 2) = (*M)(2, 0) = p.slope * q(3);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                    const Eigen::Matrix<S, 4, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    (*f)(0) = -1.0 - v(0);
    (*f)(1) = S(-4.0);
    (*f)(2) = p.pull + (4.0 + p.pull) * v(0);
    (*f)(3) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 4, 1>& q, Eigen::Matrix<S, 3, 1>* a) {
    for (int i = 0; i < 3; ++i) (*a)(i) = q(i);
  }
};

constexpr double kFall = 0.3, kSlide = 0.7, kRest = 0.05;

/// h falls at speed 1 (f_h = 0 then) and s slides to 0 meanwhile, a and b at rest.
Vector Start() {
  Vector x = Vector::Zero(8);
  x << kFall, 0, 0, -kSlide * kFall, -1, 0, 0, kSlide;
  return x;
}

TEST(DegenerateImpact, IsFollowedOnBothSides) {
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  int kinks = 0;
  for (int system_number = 0; system_number < 12; ++system_number) {
    // The force on b after the impact alone decides whether the side it starts on matters.
    const bool leaves = system_number % 2 == 0;
    const auto chain = test::Make<Chain>({{"first", 0.2 + 0.5 * uniform(generator)},
                                          {"second", 0.2 + 0.4 * uniform(generator)},
                                          {"slope", 0.5 + uniform(generator)},
                                          {"pull", leaves ? 6.0 : -1.0}});
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    options.speed_tolerance = 1e-10;
    const Trajectory run = Simulate(chain, Start(), Vector(0), kFall + kRest, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size());
    ASSERT_EQ(!leaves, run.transitions[0].mode_after.Contains(2));
    const BDerivative B = DifferentiateOutcome(chain, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_EQ(!leaves, B.PiecewiseLinear().ok());
    if (leaves) {
      EXPECT_NE(std::string::npos, B.PiecewiseLinear().message.find("'far'"));
      EXPECT_THROW(B.Pieces(), NotPiecewiseLinear);
      EXPECT_FALSE(B.IsDifferentiable());
    }
    Vector s = Vector::Zero(8);
    s(3) = 1;
    const double kink = (B(s) + B(-s)).cwiseAbs().maxCoeff();
    if (leaves) {
      EXPECT_GT(kink, 0.05);
      ++kinks;
    } else {
      EXPECT_LE(kink, 1e-8);
    }
    for (const Vector& w : {s, Vector(-s)}) {
      const QuotientReport report = CompareWithQuotients(chain, Start(), Vector(0), kFall + kRest,
                                                         w, B(w), {1e-4, 1e-5, 1e-6}, options);
      for (const QuotientSample& sample : report.samples) {
        ASSERT_TRUE(sample.status.ok()) << sample.status.message;
      }
      // Off by O(1) at every α if wrong, by O(α) if right.
      EXPECT_LE(report.samples[2].error, 0.05 * report.samples[0].error + 1e-5)
          << "system " << system_number << " side " << w(3) << ": " << report.samples[0].error
          << " " << report.samples[1].error << " " << report.samples[2].error;
    }
  }
  EXPECT_EQ(6, kinks);
}

/// Where the coupling is the same all around, there is nothing to decide.
TEST(DegenerateImpact, WithoutASlopeIsSmooth) {
  const auto chain = test::Make<Chain>({{"slope", 0.0}, {"pull", 6.0}});
  const Trajectory run = Simulate(chain, Start(), Vector(0), kFall + kRest);
  const BDerivative B = DifferentiateOutcome(chain, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B.PiecewiseLinear().ok()) << B.PiecewiseLinear().message;
  EXPECT_TRUE(B.IsDifferentiable());
}

}  // namespace
}  // namespace contact_flow
