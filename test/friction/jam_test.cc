// SPDX-License-Identifier: BSD-3-Clause
// A rod that slides into the singular point of its slip (Painlevé), beside a floor that gives way a
// little: stiffer and stiffer, its motion goes to that of the impact without collision.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "src/dynamics/impact_process.h"
#include "test/friction/systems/rod.h"
#include "test/friction/systems/tip.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kHalfLength = 0.5, kRodFriction = 1.6;
constexpr double kRodInertia = kHalfLength * kHalfLength / 3;

using RodState = std::array<double, 6>;  // x, z, θ and their rates

/// Forces of a spring and a damper at the foot, friction by a steep tanh: no impulses, no modes.
RodState CompliantField(const RodState& y, double stiffness) {
  const double l = kHalfLength, s = std::sin(y[2]), c = std::cos(y[2]);
  const double gap = y[1] - l * c, closing = y[4] + l * s * y[5], slip = y[3] - l * c * y[5];
  const double damping = 2 * std::sqrt(stiffness / 4);
  const double N = gap < 0 ? std::max(0.0, -stiffness * gap - damping * closing) : 0.0;
  const double T = -kRodFriction * N * std::tanh(slip / 1e-4);
  return {y[3], y[4], y[5], T, N - kGravity, (N * l * s - T * l * c) / kRodInertia};
}

RodState CompliantRun(RodState y, double duration, double stiffness) {
  const int steps = static_cast<int>(std::ceil(duration * std::sqrt(stiffness) * 200));
  const double h = duration / steps;
  const auto beside = [&y](const RodState& slope, double h) {
    RodState z = y;
    for (std::size_t i = 0; i < 6; ++i) z[i] += h * slope[i];
    return z;
  };
  for (int k = 0; k < steps; ++k) {
    const RodState a = CompliantField(y, stiffness);
    const RodState b = CompliantField(beside(a, h / 2), stiffness);
    const RodState c = CompliantField(beside(b, h / 2), stiffness);
    const RodState d = CompliantField(beside(c, h), stiffness);
    for (std::size_t i = 0; i < 6; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}

std::unique_ptr<MechanicalSystem> SteepRod() {
  return MakeSystem<test::Rod>({{"mu0", kRodFriction},
                                {"mu1", kRodFriction},
                                {"mass", 1},
                                {"half_length", kHalfLength},
                                {"gravity", kGravity}});
}

/// The foot on the ground, slipping backward at 2 m/s.
RodState OnFoot(double theta, double rate) {
  constexpr double kSlip = -2;
  const double l = kHalfLength, s = std::sin(theta), c = std::cos(theta);
  return {0, l * c, theta, kSlip + l * c * rate, -l * s * rate, rate};
}

/// 1 − μ G_nt/G_nn of the foot's slip backward.
double Regularity(double theta) {
  const double l = kHalfLength, s = std::sin(theta), c = std::cos(theta);
  return 1 - kRodFriction * l * l * s * c / (kRodInertia + l * l * s * s);
}

TEST(Jam, MarginsTellHowNearASlipComesToIt) {
  const auto rod = SteepRod();
  for (const double theta : {0.1, 0.9, 1.2}) {
    for (const double rate : {-0.5, 0.5}) {
      const RodState start = OnFoot(theta, rate);
      const Vector x = Eigen::Map<const Vector>(start.data(), 6);
      const Trajectory run = Simulate(*rod, x, Vector::Zero(0), 0.002);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      ASSERT_EQ("-o", run.arcs.back().mode.Word(2));
      const double least = std::min(Regularity(theta), Regularity(run.State(run.t_end())(2)));
      EXPECT_NEAR(least, run.margins.painleve, 1e-12) << theta << ' ' << rate;
    }
  }
  const Trajectory standing = Simulate(*rod, rod->nominal().x, Vector::Zero(0), 1e-6);
  EXPECT_EQ(Margins::kNone, standing.margins.painleve);  // it slips nowhere
}

TEST(Jam, IsTheLimitOfFloorsThatGiveWay) {
  const auto rod = SteepRod();
  for (const double rate : {-3.3, -4.0}) {
    const RodState start = OnFoot(0.78, rate);
    const Vector x = Eigen::Map<const Vector>(start.data(), 6);
    const Trajectory run = Simulate(*rod, x, Vector::Zero(0), 0.01);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_FALSE(run.transitions.empty());
    const Transition& jam = run.transitions.front();
    EXPECT_EQ("-o", run.arcs.front().mode.Word(2)) << rate;
    EXPECT_EQ(Outcome::kPainleveCrossing, jam.obstacle.outcome) << jam.obstacle.message;
    EXPECT_FALSE(run.warnings.empty());
    EXPECT_NEAR(0, run.margins.painleve, 1e-3);
    // 2 ms later.
    const double T = jam.t + 2e-3;
    const Vector rigid = run.State(T);
    double before = 0;
    for (const double stiffness : {1e8, 1e10}) {
      const RodState y = CompliantRun(start, T, stiffness);
      const double off = (Eigen::Map<const Vector>(y.data(), 6) - rigid).cwiseAbs().maxCoeff();
      std::printf("rate %g, stiffness %g: %.4f of %.4f\n", rate, stiffness, off,
                  rigid.cwiseAbs().maxCoeff());
      EXPECT_LE(off, 0.05) << rigid.transpose();
      if (stiffness > 1e9) EXPECT_LT(off, before);
      before = off;
    }
    EXPECT_FALSE(DifferentiateOutcome(*rod, run).status.ok());
  }
}

/// Parameters of tips with this M⁻¹.
ParameterValues WithReach(const Matrix& reach, ParameterValues values) {
  const Matrix mass = reach.inverse();
  const Eigen::Index d = mass.rows();
  for (Eigen::Index i = 0; i < d * d; ++i) values["m" + std::to_string(i)] = mass(i / d, i % d);
  return values;
}

using TipState = std::array<double, 4>;  // z, and the velocity of a tip in space

/// Presses and turns as on a spring with so much damping that it gives nothing back.
TipState DampedSlide(const Eigen::Matrix3d& reach, TipState y, double stiffness, double damping) {
  const auto field = [&](const TipState& s) -> TipState {
    const double N = std::max(0.0, -stiffness * s[0] - damping * s[3]) * (s[0] < 0 ? 1 : 0);
    const double speed = std::hypot(s[1], s[2]);
    const Eigen::Vector3d v = reach * (N * Eigen::Vector3d(-s[1] / speed, -s[2] / speed, 1));
    return {s[3], v(0), v(1), v(2)};
  };
  const auto beside = [](TipState s, const TipState& slope, double h) {
    for (std::size_t i = 0; i < 4; ++i) s[i] += h * slope[i];
    return s;
  };
  const double h = 0.1 / damping;
  while (y[0] < 0) {
    const TipState a = field(y), b = field(beside(y, a, h / 2)), c = field(beside(y, b, h / 2)),
                   d = field(beside(y, c, h));
    for (std::size_t i = 0; i < 4; ++i) y[i] += h / 6 * (a[i] + 2 * b[i] + 2 * c[i] + d[i]);
  }
  return y;
}

/// The slip turns until it presses no more: no single impulse of a jammed slip does that, the
/// process along it does.
TEST(Jam, InSpaceTurnsTheSlip) {
  Eigen::Matrix3d reach;
  reach << 5, 2, 0.9, 2, 5, 1.2, 0.9, 1.2, 1;
  const auto tip = MakeSystem<test::Tip<3>>(WithReach(reach, {{"mu0", 1}}));
  const Vector q = Vector::Zero(3), v = Eigen::Vector3d(1, 0.2, 0);
  ContactMode slides;
  slides.Set(0, Letter::kSlip);
  const std::optional<FrictionalImpact> impact = FollowImpact(*tip, q, v, slides, 0);
  ASSERT_TRUE(impact);
  EXPECT_EQ("l", impact->word.Word(1));
  EXPECT_NEAR(0, impact->result.v_plus(2), 1e-9);
  EXPECT_LT(impact->energy_change, 0);
  double before = 1;
  for (const double ratio : {20.0, 80.0}) {
    const double stiffness = 1e8;
    const TipState end =
        DampedSlide(reach, {-1e-12, v(0), v(1), v(2)}, stiffness, ratio * std::sqrt(stiffness));
    const double off =
        std::hypot(end[1] - impact->result.v_plus(0), end[2] - impact->result.v_plus(1));
    std::printf("damping %g: %.5f of %.5f\n", ratio, off, impact->result.v_plus.norm());
    EXPECT_LT(off, 0.25 * before);
    before = off;
  }
  EXPECT_LT(before, 1e-3);
}

/// Where the force of a slip has no bound is not known to the last digit: a slip that turns into
/// falling jams a little before, as it does a little behind.
TEST(Jam, BeginsNearTheSingularSlip) {
  Eigen::Matrix3d reach;
  reach << 2, 0, 1.2, 0, 6, 0.6, 1.2, 0.6, 1;
  const auto tip = MakeSystem<test::Tip<3>>(WithReach(reach, {{"mu0", 1}}));
  ContactMode slides;
  slides.Set(0, Letter::kSlip);
  // 1.2 cos θ + 0.6 sin θ = 1: cos(θ − φ) = 1/√1.8, tan φ = 1/2.
  const double singular = std::atan(0.5) - std::acos(1 / std::sqrt(1.8));
  const auto impact_at = [&](double theta) {
    const Vector v = Eigen::Vector3d(std::cos(theta), std::sin(theta), 0);
    return FollowImpact(*tip, Vector::Zero(3), v, slides, 0);
  };
  const auto behind = impact_at(singular + 1e-6), before = impact_at(singular - 1e-6);
  ASSERT_TRUE(behind && before);
  EXPECT_NEAR(0, before->result.v_plus(2), 1e-9);
  EXPECT_GT(before->result.impulse(0), 0.1);
  EXPECT_LT((before->result.v_plus - behind->result.v_plus).norm(), 1e-4);
  EXPECT_LT((before->result.impulse - behind->result.impulse).norm(), 1e-4);
  EXPECT_FALSE(impact_at(singular - 1e-2));  // a slip that goes on
}

/// Two tips: the first jams, p = (t, n) with (5 t + 1.5 n, 1.5 t + n) = (−1, 0), and throws up the
/// other one, which slips beside it: by 0.3 n. To hold that down it would have to be pulled.
TEST(Jam, LetsGoWhatItWouldPull) {
  Eigen::Matrix4d reach = Eigen::Matrix4d::Identity();  // of x1, z1, x2, z2
  reach(0, 0) = 5;
  reach(0, 1) = reach(1, 0) = 1.5;
  reach(1, 3) = reach(3, 1) = 0.3;
  const auto tips = MakeSystem<test::Tips<2>>(WithReach(reach, {{"mu0", 1}, {"mu1", 0.2}}));
  const Vector v = Eigen::Vector4d(1, 0, 1, 0);
  ContactMode slide;
  slide.Set(0, Letter::kForward);
  slide.Set(1, Letter::kForward);
  const std::optional<FrictionalImpact> impact = FollowImpact(*tips, Vector::Zero(4), v, slide, 0);
  ASSERT_TRUE(impact);
  EXPECT_EQ("so", impact->word.Word(2));
  EXPECT_EQ(ConstraintSet({0}), impact->result.hit);
  EXPECT_TRUE(impact->result.v_plus.isApprox(Eigen::Vector4d(0, 0, 1, 0.3 * 6 / 11), 1e-9))
      << impact->result.v_plus.transpose();
  EXPECT_NEAR(-2.0 / 11, impact->energy_change, 1e-9);
}

/// Two tips: the first jams, presses the other one down by 0.3 n and moves it by 0.3 n, which
/// friction of 0.5 does not hold: p2 = (−0.15 n, 0.3 n). With what that gives back,
/// (5 t + 1.5 n, 1.5 t + 0.865 n) = (−1, 0).
TEST(Jam, MovesWhatItPushesOutOfItsCone) {
  Eigen::Matrix4d reach = Eigen::Matrix4d::Identity();  // of x1, z1, x2, z2
  reach(0, 0) = 5;
  reach(0, 1) = reach(1, 0) = 1.5;
  reach(1, 2) = reach(2, 1) = 0.3;
  reach(1, 3) = reach(3, 1) = -0.3;
  const auto tips = MakeSystem<test::Tips<2>>(WithReach(reach, {{"mu0", 1}, {"mu1", 0.5}}));
  ContactMode word;
  word.Set(0, Letter::kForward);
  word.Set(1, Letter::kStick);
  const Vector v = Eigen::Vector4d(1, 0, 0, 0);
  const std::optional<FrictionalImpact> impact = FollowImpact(*tips, Vector::Zero(4), v, word, 0);
  ASSERT_TRUE(impact);
  const double t = -0.865 / 1.5, n = 1 / (-5 * t - 1.5);
  EXPECT_EQ("s+", impact->word.Word(2));
  EXPECT_TRUE(impact->result.v_plus.isApprox(Eigen::Vector4d(0, 0, 0.15 * n, 0), 1e-8))
      << impact->result.v_plus.transpose();
  EXPECT_NEAR((t * n - 0.15 * n * 0.15 * n) / 2, impact->energy_change, 1e-8);
}

/// A tip jams as long as nothing holds the second one beside it, which friction does not.
TEST(Jam, BeginsBesideWhatDoesNotHold) {
  Eigen::Matrix4d reach = Eigen::Matrix4d::Identity();  // of x1, z1, x2, z2
  reach(0, 0) = 5;
  reach(0, 1) = reach(1, 0) = 1.5;
  reach(0, 2) = reach(2, 0) = 1.6;
  reach(1, 2) = reach(2, 1) = 0.8;
  const auto tips = MakeSystem<test::Tips<2>>(WithReach(reach, {{"mu0", 1}, {"mu1", 0.5}}));
  ContactMode word;
  word.Set(0, Letter::kForward);
  word.Set(1, Letter::kStick);
  const Vector v = Eigen::Vector4d(1, 0, 0, 0);
  const std::optional<FrictionalImpact> impact = FollowImpact(*tips, Vector::Zero(4), v, word, 0);
  ASSERT_TRUE(impact);  // (5 t + 1.5 n, 1.5 t + n) = (−1, 0)
  EXPECT_EQ("s-", impact->word.Word(2));
  EXPECT_TRUE(impact->result.v_plus.isApprox(Eigen::Vector4d(0, 0, -1.6 / 11, 0), 1e-8))
      << impact->result.v_plus.transpose();
}

/// The jammed tip presses down the second, which slips backward and is turned within a step.
/// Forward it is singular itself, 1 − μ/2 = 0: no force holds it down, and there is no impact.
TEST(Jam, EndsWhereAnotherSlipIsSingularWithinAStep) {
  Matrix reach = Matrix::Identity(6, 6);  // of x1, z1, x2, z2, x3, z3
  reach(0, 0) = 5;
  reach(0, 1) = reach(1, 0) = 1.5;
  reach(0, 2) = reach(2, 0) = -0.3;
  reach(1, 3) = reach(3, 1) = -0.3;
  reach(2, 3) = reach(3, 2) = 0.5;
  const auto tips = MakeSystem<test::Tips<3>>(WithReach(reach, {{"mu0", 1}, {"mu1", 2}}));
  ContactMode word;
  word.Set(0, Letter::kForward);
  word.Set(1, Letter::kBackward);
  word.Set(2, Letter::kStick);
  Vector v = Vector::Zero(6);
  v(0) = 1;
  v(2) = -0.001;
  EXPECT_FALSE(FollowImpact(*tips, Vector::Zero(6), v, word, 0));
}

}  // namespace
}  // namespace contact_flow
