// SPDX-License-Identifier: BSD-3-Clause
// A hopper lifts off vertically: where its contact force reaches zero friction does, too, and no
// acceleration is left that would be a scale of what is decided there.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kFoot = 2, kBody = 3, kStiffness = 400, kSpringLength = 1;

/// A foot and a body above it on a spring; a wall far away may have friction of its own.
struct Hopper {
  static constexpr const char* kName = "hopper";
  static constexpr const char* kSummary = "two masses and a spring";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "foot", "body"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"toe", "wall"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  using Parameters = test::ContactParameters<P>;
  template <class S>
  using V = Eigen::Matrix<S, 3, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const V<S>&, Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = S(kFoot + kBody);
    (*M)(1, 1) = S(kFoot);
    (*M)(2, 2) = S(kBody);
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const V<S>& q, const V<S>&, const Eigen::Matrix<S, 0, 1>&,
                    V<S>* f) {
    const S pull = kStiffness * (q(2) - q(1) - kSpringLength);
    (*f)(0) = S(0.0);
    (*f)(1) = pull - kFoot * kGravity;
    (*f)(2) = -pull - kBody * kGravity;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const V<S>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = 5.0 - q(0);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const V<S>&, const V<S>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.Mu(i);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.Gamma(i);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// From rest at the height `body`: the instant of lift-off, and of all mass its height at `t`.
struct Ballistic {
  double lift_off, height;
  Ballistic(double body, double t) {
    const double omega = std::sqrt(kStiffness / kBody), all = kFoot + kBody;
    const double middle = kSpringLength - kBody * kGravity / kStiffness;
    const double risen = kSpringLength + kFoot * kGravity / kStiffness;
    const double phase = std::acos((risen - middle) / (body - middle));
    const double speed = -(body - middle) * omega * std::sin(phase);
    lift_off = phase / omega;
    const double after = t - lift_off;
    height = (kBody * (risen + speed * after) - 0.5 * all * kGravity * after * after) / all;
  }
};

void ExpectLiftOffs(double toe, double wall) {
  const auto system = MakeSystem<Hopper>({{"mu0", toe}, {"mu1", wall}});
  const double duration = 0.24, all = kFoot + kBody;
  for (int k = 0; k < 40; ++k) {
    Vector x = Vector::Zero(6);
    x(2) = 0.7 + 0.001 * k;
    const Ballistic exact(x(2), duration);
    const Trajectory run = Simulate(*system, x, Vector::Zero(0), duration);
    ASSERT_TRUE(run.status.ok()) << "from " << x(2) << ": " << run.status.message;
    ASSERT_EQ(1u, run.transitions.size());
    // Runs to 1e-9, over a few steps.
    EXPECT_NEAR(exact.lift_off, run.transitions[0].t, 1e-8);
    EXPECT_TRUE(run.transitions[0].mode_after.Empty());
    const Vector end = run.FinalState();
    EXPECT_NEAR(exact.height, (kFoot * end(1) + kBody * end(2)) / all, 1e-8);
    if (k % 10 > 0) continue;
    const BDerivative B = DifferentiateOutcome(*system, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    // Quotients over 1e-5: third derivatives of the closed form are below 1e3.
    const double step = 1e-5;
    const double slope =
        (Ballistic(x(2) + step, duration).height - Ballistic(x(2) - step, duration).height) /
        (2 * step);
    const Vector by = B(Vector::Unit(6, 2));
    EXPECT_NEAR(slope, (kFoot * by(1) + kBody * by(2)) / all, 1e-6);
  }
}

TEST(LiftOff, OfAContactWithFriction) { ExpectLiftOffs(0.8, 0); }
TEST(LiftOff, OfAContactWithoutSlip) { ExpectLiftOffs(-1, 0); }
TEST(LiftOff, OfOneWithoutFrictionBesideOneWith) { ExpectLiftOffs(0, 0.5); }

}  // namespace
}  // namespace contact_flow
