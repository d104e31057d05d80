// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/radau.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

namespace contact_flow {
namespace {

/// A system q̈ = a(q, q̇) on lines, with its Jacobian [K D].
struct Plain {
  int d;
  std::function<Vector(const Vector& q, const Vector& v)> a;
  std::function<Matrix(const Vector& q, const Vector& v)> jacobian;

  Radau::Field Field() const {
    return [this](int, const double* x, double* xdot) {
      const Vector q = Vector::Map(x, d), v = Vector::Map(x + d, d);
      Vector::Map(xdot, d) = v;
      Vector::Map(xdot + d, d) = a(q, v);
    };
  }
  Radau::Jacobian Derivative() const {
    return [this](const Vector& x, Matrix* out) { *out = jacobian(x.head(d), x.tail(d)); };
  }
};

Vector Of(std::initializer_list<double> values) {
  return Vector::Map(values.begin(), static_cast<Eigen::Index>(values.size()));
}

Matrix RowOf(std::initializer_list<double> values) { return Of(values).transpose(); }

Plain Pendulum() {
  return {1, [](const Vector& q, const Vector&) { return Of({-std::sin(q(0))}); },
          [](const Vector& q, const Vector&) {
            return RowOf({-std::cos(q(0)), 0});
          }};
}

/// Prothero and Robinson's ẇ = λ (w − φ(t)) + φ'(t), with t and ∫w among the coordinates;
/// φ = sin t. Its solution from w = 0 on is w = sin t, q = 1 − cos t.
Plain ProtheroRobinson(double lambda) {
  return {2,
          [=](const Vector& q, const Vector& v) {
            return Of({0, lambda * (v(1) - std::sin(q(0))) + std::cos(q(0))});
          },
          [=](const Vector& q, const Vector&) {
            Matrix J = Matrix::Zero(2, 4);
            J(1, 0) = -lambda * std::cos(q(0)) - std::sin(q(0));
            J(1, 3) = lambda;
            return J;
          }};
}

/// Van der Pol's q̈ = μ (1 − q²) q̇ − q.
Plain VanDerPol(double mu) {
  return {
      1,
      [=](const Vector& q, const Vector& v) { return Of({mu * (1 - q(0) * q(0)) * v(0) - q(0)}); },
      [=](const Vector& q, const Vector& v) {
        return RowOf({-2 * mu * q(0) * v(0) - 1, mu * (1 - q(0) * q(0))});
      }};
}

constexpr double kTight = 1e-14;

Vector After(const Plain& plain, int s, const Vector& x, double time, int steps) {
  const ConfigurationSpace space(plain.d);
  Radau stepper(space, s, plain.Field(), plain.Derivative());
  stepper.Begin(x);
  for (int k = 0; k < steps; ++k) {
    stepper.TryStep(time / steps, kTight, kTight);
    stepper.Finish();
    stepper.Advance();
  }
  return stepper.begin();
}

class RadauOf : public testing::TestWithParam<int> {};

/// B(2s−1), C(s) and D(s−1) of Butcher, which together give the order 2s − 1.
TEST_P(RadauOf, HasTheOrderConditions) {
  const int s = GetParam();
  const RadauRule& rule = RadauRule::WithStages(s);
  constexpr double kDigits = 4e-15;  // sums of s products of numbers below 1
  EXPECT_EQ(1, rule.c(s - 1));
  const Vector b = rule.a.row(s - 1);  // stiffly accurate
  for (int k = 1; k <= 2 * s - 1; ++k) {
    EXPECT_NEAR(1.0 / k, b.dot(rule.c.array().pow(k - 1).matrix()), kDigits);
  }
  for (int k = 1; k <= s; ++k) {
    const Vector power = rule.c.array().pow(k - 1), next = rule.c.array().pow(k) / k;
    EXPECT_LT((rule.a * power - next).cwiseAbs().maxCoeff(), kDigits) << k;
  }
  for (int k = 1; k <= s - 1; ++k) {
    const Vector power = rule.c.array().pow(k - 1), next = (1 - rule.c.array().pow(k)) / k;
    const Vector left = rule.a.transpose() * b.cwiseProduct(power);
    EXPECT_LT((left - b.cwiseProduct(next)).cwiseAbs().maxCoeff(), kDigits) << k;
  }
  EXPECT_LT((rule.a * rule.inverse - Matrix::Identity(s, s)).cwiseAbs().maxCoeff(), 40 * kDigits);
}

/// T Λ T⁻¹ = A⁻¹, in its real and complex parts.
TEST_P(RadauOf, IsDiagonalized) {
  const int s = GetParam();
  const RadauRule& rule = RadauRule::WithStages(s);
  Matrix again = rule.real_eigenvalue * rule.from_real * rule.to_real.transpose();
  for (std::size_t k = 0; k < rule.eigenvalues.size(); ++k) {
    again += (rule.eigenvalues[k] * rule.from_pair[k] * rule.to_pair[k].transpose()).real();
  }
  // Entries of T and its inverse are a few tens.
  EXPECT_LT((again - rule.inverse).cwiseAbs().maxCoeff(), 1e-12);
  if (s == 3) {  // Hairer & Wanner II, (IV.8.14): γ = 1/(…) in closed form
    const double root = std::cbrt(9.0);
    EXPECT_NEAR(3 + root - std::cbrt(3.0), rule.real_eigenvalue, 1e-14);
    EXPECT_NEAR((4 - std::sqrt(6.0)) / 10, rule.c(0), 1e-16);
  }
}

TEST_P(RadauOf, HasOrderTwoSMinusOne) {
  const int s = GetParam();
  const Plain pendulum = Pendulum();
  const Vector start = Of({1, 0.3}), exact = After(pendulum, 5, start, 2, 48);
  const int n = s == 3 ? 16 : 4;
  const double coarse = (After(pendulum, s, start, 2, n) - exact).norm(),
               fine = (After(pendulum, s, start, 2, 2 * n) - exact).norm();
  EXPECT_GT(coarse, 1e3 * 1e-16) << "not rounding";
  // Halving the step divides the error by 2^{2s−1}, give or take the next term.
  EXPECT_NEAR(2 * s - 1, std::log2(coarse / fine), 0.6);
}

TEST_P(RadauOf, TheExtensionHasOrderSPlusOne) {
  const int s = GetParam();
  const Plain pendulum = Pendulum();
  const ConfigurationSpace space(1);
  const auto error = [&](double h) {
    Radau stepper(space, s, pendulum.Field(), pendulum.Derivative());
    stepper.Begin(Of({1, 0.3}));
    stepper.TryStep(h, kTight, kTight);
    stepper.Finish();
    stepper.Extend();
    double worst = 0;
    for (double theta : {0.1, 0.2, 0.5, 0.7, 0.9}) {
      Vector x(2);
      stepper.Interpolate(theta, x.data());
      worst = std::max(worst, (x - After(pendulum, 5, Of({1, 0.3}), theta * h, 12)).norm());
    }
    return worst;
  };
  EXPECT_NEAR(s + 2, std::log2(error(0.4) / error(0.2)), 0.6);  // local error
}

TEST_P(RadauOf, TheExtensionMeetsBothEnds) {
  const Plain pendulum = Pendulum();
  const ConfigurationSpace space(1);
  Radau stepper(space, GetParam(), pendulum.Field(), pendulum.Derivative());
  stepper.Begin(Of({1, 0.3}));
  stepper.TryStep(0.3, kTight, kTight);
  stepper.Finish();
  stepper.Extend();
  Vector x(2), near(2);
  stepper.Interpolate(0, x.data());
  EXPECT_EQ(0, (x - stepper.begin()).norm());
  stepper.Interpolate(1, x.data());
  EXPECT_LE((x - stepper.end()).norm(), 1e-15);
  // Its slopes are F there: at the beginning up to the filter, h/γ of the defect.
  constexpr double kSmall = 1e-6;
  stepper.Interpolate(1 - kSmall, near.data());
  EXPECT_LT(((x - near) / (kSmall * 0.3) - stepper.end_field()).norm(), 1e-5);
}

/// The estimate covers the error of the extension, on motions that are smooth, stiff, and
/// with a transient.
TEST_P(RadauOf, TheErrorEstimateCoversTheError) {
  const int s = GetParam();
  struct Case {
    Plain plain;
    Vector start;
  };
  const std::vector<Case> cases = {{Pendulum(), Of({1, 0.3})},
                                   {ProtheroRobinson(-1e5), Of({0.3, 0, 1, std::sin(0.3)})},
                                   {ProtheroRobinson(-10), Of({0.3, 0, 1, std::sin(0.3) + 1e-3})},
                                   {VanDerPol(1e3), Of({2, -2.0 / 3e3})}};
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Plain& plain = cases[k].plain;
    const ConfigurationSpace space(plain.d);
    for (double h : {0.1, 0.2, 0.4}) {
      Radau stepper(space, s, plain.Field(), plain.Derivative());
      stepper.Begin(cases[k].start);
      constexpr double kTolerance = 1e-9;
      const double scaled = stepper.TryStep(h, kTolerance, kTolerance);
      ASSERT_TRUE(stepper.end().allFinite());
      stepper.Finish();
      stepper.Extend();
      double worst = 0;
      for (double theta : {0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.95, 1.0}) {
        Vector x(2 * plain.d);
        stepper.Interpolate(theta, x.data());
        const Vector exact = After(plain, 5, cases[k].start, theta * h, 200);
        worst = std::max(worst, (x - exact).cwiseAbs().maxCoeff());
      }
      const double estimate = stepper.LocalErrors().maxCoeff();
      EXPECT_GT(2 * estimate + 1e-13, worst) << "case " << k << ", h = " << h;
    }
  }
}

/// L-stable: R(∞) = 0, and stiff errors do not come back.
TEST_P(RadauOf, StiffErrorsAreGoneAfterOneStep) {
  const Plain plain = ProtheroRobinson(-1e9);
  const Vector start = Of({0, 0, 1, 0.5});  // off the slow motion by 0.5
  const Vector end = After(plain, GetParam(), start, 0.1, 1);
  EXPECT_NEAR(std::sin(0.1), end(3), 1e-7);  // 0.5 R(−1e8), R(z) ~ s/z or so
}

TEST_P(RadauOf, AStepOfNoLengthStays) {
  const Plain pendulum = Pendulum();
  const ConfigurationSpace space(1);
  Radau stepper(space, GetParam(), pendulum.Field(), pendulum.Derivative());
  stepper.Begin(Of({1, 0.3}));
  EXPECT_EQ(0, stepper.TryStep(0, 1e-9, 1e-9));
  EXPECT_EQ(0, (stepper.end() - stepper.begin()).norm());
  stepper.Finish();
  stepper.Extend();
  EXPECT_LE(stepper.TryStep(0.1, 1e-4, 1e-4), 1);
  EXPECT_NEAR(1 + 0.1 * 0.3 - 0.005 * std::sin(1), stepper.end()(0), 1e-3);
}

TEST_P(RadauOf, AStepMayBeRepeatedFromTheSamePoint) {
  const Plain pendulum = Pendulum();
  const ConfigurationSpace space(1);
  Radau stepper(space, GetParam(), pendulum.Field(), pendulum.Derivative());
  stepper.Begin(Of({1, 0.3}));
  stepper.TryStep(0.2, 1e-9, 1e-9);
  const Vector once = stepper.end();
  stepper.TryStep(0.4, 1e-9, 1e-9);
  stepper.Finish();
  stepper.TryStep(0.2, 1e-9, 1e-9);
  EXPECT_LT((stepper.end() - once).norm(), 1e-12) << "within Newton's part of the tolerance";
  stepper.Restart();
  stepper.TryStep(0.2, 1e-9, 1e-9);
  EXPECT_EQ(0, (stepper.end() - once).norm());
}

/// A free top: the quaternion's equations, with ω × Iω in the acceleration, against tiny steps.
TEST_P(RadauOf, TurnsABody) {
  ConfigurationSpace space;
  space.Append(ConfigurationSpace::Factor::kRotation);
  const Eigen::Vector3d inertia(1, 2, 3.5);
  const auto cross = [](const Eigen::Vector3d& w) {
    Eigen::Matrix3d W;
    W << 0, -w(2), w(1), w(2), 0, -w(0), -w(1), w(0), 0;
    return W;
  };
  const auto field = [&](int, const double* x, double* xdot) {
    space.Rate(x, x + 4, xdot);
    const Eigen::Vector3d w(x[4], x[5], x[6]);
    Eigen::Vector3d::Map(xdot + 4) = -w.cross(inertia.cwiseProduct(w)).cwiseQuotient(inertia);
  };
  const auto jacobian = [&](const Vector& x, Matrix* J) {
    const Eigen::Vector3d w = x.tail(3);
    *J = Matrix::Zero(3, 6);
    J->rightCols(3) = inertia.cwiseInverse().asDiagonal() *
                      (cross(inertia.cwiseProduct(w)) - cross(w) * inertia.asDiagonal());
  };
  const auto after = [&](int steps) {
    Radau stepper(space, GetParam(), field, jacobian);
    stepper.Begin(Of({1, 0, 0, 0, 0.3, 2, 0.1}));
    for (int k = 0; k < steps; ++k) {
      stepper.TryStep(1.0 / steps, 1e-13, 1e-13);
      EXPECT_LE(stepper.iterations(), 7);
      stepper.Finish();
      stepper.Advance();
    }
    return stepper.begin();
  };
  const int n = GetParam() == 3 ? 20 : 12;
  const Vector exact = after(8 * n);
  EXPECT_NEAR(1, exact.head(4).norm(), 1e-12);
  const double coarse = (after(n) - exact).norm(), fine = (after(2 * n) - exact).norm();
  if (GetParam() == 3) {
    EXPECT_NEAR(5, std::log2(coarse / fine), 0.8) << coarse << ' ' << fine;
  } else {
    EXPECT_LT(coarse, 1e-13) << "rounding: half as many steps are too long for Newton's method";
  }
}

INSTANTIATE_TEST_SUITE_P(Stages, RadauOf, testing::Values(3, 5));

}  // namespace
}  // namespace contact_flow
