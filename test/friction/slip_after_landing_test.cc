// SPDX-License-Identifier: BSD-3-Clause
// Masses on springs land so steeply that they stick, and so lightly that friction does not hold
// them there: each begins to slip at once, in a direction that depends on where it has landed.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/tip.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kLandedFriction = 0.5, kSpringRestY = 0.6, kLandedDuration = 0.7;
constexpr double kSpringX = 9, kSpringY = 14, kSpringRestX = 0.5;

using Glide = std::array<double, 4>;  // x, y and their rates

Glide BesideGlide(const Glide& y, const Glide& slope, double h) {
  Glide z = y;
  for (std::size_t i = 0; i < 4; ++i) z[i] += h * slope[i];
  return z;
}

/// Springs, and friction μ g against the slip; of none, against the pull.
Glide GlideField(const Glide& y, double friction) {
  const double pull_x = kSpringX * (kSpringRestX - y[0]), pull_y = kSpringY * (kSpringRestY - y[1]);
  const double slip = std::hypot(y[2], y[3]), pull = std::hypot(pull_x, pull_y);
  const double along_x = slip > 0 ? y[2] / slip : pull_x / pull;
  const double along_y = slip > 0 ? y[3] / slip : pull_y / pull;
  return {y[2], y[3], pull_x - friction * along_x, pull_y - friction * along_y};
}

Glide GlideOn(Glide y, double duration, double friction) {
  constexpr int kSteps = 4000;
  const double h = duration / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const Glide a = GlideField(y, friction), b = GlideField(BesideGlide(y, a, h / 2), friction);
    const Glide c = GlideField(BesideGlide(y, b, h / 2), friction),
                d = GlideField(BesideGlide(y, c, h), friction);
    for (std::size_t i = 0; i < 4; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}

/// x, y, ẋ, ẏ at the end, by the law of fall and by Runge and Kutta's method.
Eigen::Vector4d OutcomeOfLanding(const Vector& x) {
  const double landing = (x(5) + std::sqrt(x(5) * x(5) + 2 * kGravity * x(2))) / kGravity;
  Glide y = GlideOn({x(0), x(1), x(3), x(4)}, landing, 0);
  y[2] = y[3] = 0;
  y = GlideOn(y, kLandedDuration - landing, kLandedFriction * kGravity);
  return {y[0], y[1], y[2], y[3]};
}

TEST(SlipAfterLanding, HasTheDerivativeOfItsMotion) {
  const auto tip = MakeSystem<test::Tip<3>>({{"mu0", kLandedFriction},
                                             {"f0", kSpringX * kSpringRestX},
                                             {"f1", kSpringY * kSpringRestY},
                                             {"f2", -kGravity},
                                             {"k0", kSpringX},
                                             {"k1", kSpringY}});
  Vector x(6);
  x << 0.05, -0.1, 0.3, 0.1, -0.2, -1.5;
  const SimulateOptions tight = test::Tight();
  const Trajectory run = Simulate(*tip, x, Vector(), kLandedDuration, tight);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ("l", run.transitions[0].mode_after.Word(1));
  EXPECT_EQ("s", run.transitions[0].impulse_word.Word(1));
  const Vector& end = run.FinalState();
  const Eigen::Vector4d expected = OutcomeOfLanding(x);
  const int rows[] = {0, 1, 3, 4};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(expected(i), end(rows[i]), 1e-9);
  const BDerivative B = DifferentiateOutcome(*tip, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  constexpr double kStep = 1e-4;
  for (int j = 0; j < 6; ++j) {
    const Vector w = Vector::Unit(6, j), got = B(w);
    const Eigen::Vector4d quotient =
        (OutcomeOfLanding(x + kStep * w) - OutcomeOfLanding(x - kStep * w)) / (2 * kStep);
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(quotient(i), got(rows[i]), 3e-7) << i << " by " << j;
  }
}

/// What a model of N says by arrays of its size. GCC 14 evaluates no function for them.
template <int N>
struct LanderNames;

template <>
struct LanderNames<2> {
  static constexpr std::array kCoordinates = {"x1", "y1", "z1", "x2", "y2", "z2"};
  static constexpr std::array kUnits = {"m", "m", "m", "m", "m", "m"};
  static constexpr std::array kConstraintNames = {"first", "second"};
};

template <>
struct LanderNames<3> {
  static constexpr std::array kCoordinates = {"x1", "y1", "z1", "x2", "y2", "z2", "x3", "y3", "z3"};
  static constexpr std::array kUnits = {"m", "m", "m", "m", "m", "m", "m", "m", "m"};
  static constexpr std::array kConstraintNames = {"first", "second", "third"};
};

/// N such masses of 1 kg, which share nothing but a damper between the first and the second.
template <int N>
struct Landers : LanderNames<N> {
  static constexpr const char* kName = "landers";
  static constexpr const char* kSummary = "masses on springs over a floor";
  static constexpr int kDof = 3 * N, kConstraints = N, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mu = kLandedFriction, last_mu = kLandedFriction, last_gamma = 0, damping = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mu, "mu", "", "", Range::kNonNegative);
      visit(last_mu, "last_mu", "", "", Range::kNonNegative);
      visit(last_gamma, "last_gamma", "", "", Range::kUnitInterval);
      visit(damping, "damping", "N s/m", "", Range::kNonNegative);
    }
  };
  template <class S>
  using Positions = Eigen::Matrix<S, 3 * N, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const Positions<S>&,
                         Eigen::Matrix<S, 3 * N, 3 * N>* M) {
    M->setIdentity();
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Positions<S>& q, const Positions<S>& v,
                    const Eigen::Matrix<S, 0, 1>&, Positions<S>* f) {
    for (int i = 0; i < 3 * N; i += 3) {
      (*f)(i) = kSpringX * (kSpringRestX - q(i));
      (*f)(i + 1) = kSpringY * (kSpringRestY - q(i + 1));
      (*f)(i + 2) = S(-kGravity);
    }
    const S pull = p.damping * (v(3) - v(0));
    (*f)(0) += pull;
    (*f)(3) -= pull;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Positions<S>& q, Eigen::Matrix<S, N, 1>* a) {
    for (int i = 0; i < N; ++i) (*a)(i) = q(3 * i + 2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Positions<S>&, const Positions<S>& v,
                   Eigen::Matrix<S, 2 * N, 1>* s) {
    for (int i = 0; i < N; ++i) s->template segment<2>(2 * i) = v.template segment<2>(3 * i);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return i + 1 < N ? p.mu : p.last_mu;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return i + 1 < N ? P(0.0) : p.last_gamma;
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6 * N);
    run.u = Vector::Zero(0);
    return run;
  }
};

constexpr double kLastGamma = 0.99;

/// x, y, z and their rates at the end, of one that bounces once, without friction.
Vector OutcomeOfBounce(const Vector& x) {
  const double landing = (x(5) + std::sqrt(x(5) * x(5) + 2 * kGravity * x(2))) / kGravity;
  const double rise = kLastGamma * (kGravity * landing - x(5)), left = kLandedDuration - landing;
  const Glide y = GlideOn({x(0), x(1), x(3), x(4)}, kLandedDuration, 0);
  return test::Entries(
      {y[0], y[1], (rise - kGravity * left / 2) * left, y[2], y[3], rise - kGravity * left});
}

/// Of N masses that land at once, the last one as told; all entries of the end.
template <int N>
Vector OutcomeOfLandings(const Vector& x, bool last_bounces) {
  Vector end = Vector::Zero(6 * N);
  for (int i = 0; i < N; ++i) {
    Vector own(6);
    own << x.segment(3 * i, 3), x.segment(3 * N + 3 * i, 3);
    if (last_bounces && i + 1 == N) {
      const Vector y = OutcomeOfBounce(own);
      end.segment(3 * i, 3) = y.head(3);
      end.segment(3 * N + 3 * i, 3) = y.tail(3);
    } else {
      const Eigen::Vector4d y = OutcomeOfLanding(own);
      end.segment(3 * i, 2) = y.head(2);
      end.segment(3 * N + 3 * i, 2) = y.tail(2);
    }
  }
  return end;
}

/// All land at 0.3 s or so, at one instant.
template <int N>
Vector LandersApart() {
  Vector x = Vector::Zero(6 * N);
  for (int i = 0; i < N; ++i) {
    x.segment(3 * i, 3) << 0.05 + 0.1 * i, -0.1 + 0.05 * i * i, 0.3;
    x.segment(3 * N + 3 * i, 3) << 0.1 - 0.2 * i, -0.2 + 0.1 * i, -1.5;
  }
  return x;
}

template <int N>
void ExpectLandingsApart(bool last_bounces) {
  const double mu = last_bounces ? 0.0 : kLandedFriction, gamma = last_bounces ? kLastGamma : 0.0;
  const auto landers = MakeSystem<Landers<N>>({{"last_mu", mu}, {"last_gamma", gamma}});
  const Vector x = LandersApart<N>();
  const Trajectory run = Simulate(*landers, x, Vector(), kLandedDuration, test::Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  const Vector expected = OutcomeOfLandings<N>(x, last_bounces);
  for (int i = 0; i < 6 * N; ++i) EXPECT_NEAR(expected(i), run.FinalState()(i), 1e-9) << i;
  const BDerivative B = DifferentiateOutcome(*landers, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B.IsDifferentiable());
  constexpr double kStep = 1e-4;
  for (int j = 0; j < 6 * N; ++j) {
    const Vector w = Vector::Unit(6 * N, j);
    const Vector quotient = (OutcomeOfLandings<N>(x + kStep * w, last_bounces) -
                             OutcomeOfLandings<N>(x - kStep * w, last_bounces)) /
                            (2 * kStep);
    const Vector forward = B(w), backward = -B(-w);
    for (int i = 0; i < 6 * N; ++i) {
      EXPECT_NEAR(quotient(i), forward(i), 3e-7) << i << " by " << j;
      EXPECT_NEAR(quotient(i), backward(i), 3e-7) << i << " by −" << j;
    }
  }
}

TEST(SlipAfterLanding, OfSeveralThatLandAtOnceIsThatOfEach) {
  ExpectLandingsApart<2>(false);
  ExpectLandingsApart<3>(false);
}

TEST(SlipAfterLanding, BesideOneThatBouncesAtOnce) {
  ExpectLandingsApart<2>(true);
  ExpectLandingsApart<3>(true);
}

/// A damper's force jumps with the other's landing, and with it the direction of the slip that has
/// begun before: it turns within a time of first order.
TEST(SlipAfterLanding, ThatTurnsWithAnotherLandingIsRefused) {
  const auto landers = MakeSystem<Landers<2>>({{"damping", 3.0}});
  const Trajectory run =
      Simulate(*landers, LandersApart<2>(), Vector(), kLandedDuration, test::Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(*landers, run);
  std::string why = B.status.message;
  try {
    if (B.status.ok()) B(Vector::Unit(12, 2));
  } catch (const std::domain_error& reason) {
    why = reason.what();
  }
  EXPECT_NE(std::string::npos, why.find("slips otherwise, or not")) << why;
}

}  // namespace
}  // namespace contact_flow
