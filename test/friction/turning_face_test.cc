// SPDX-License-Identifier: BSD-3-Clause
// A box that slides on its face and turns: how the corners share its weight decides the motion. It
// is shared as by equal springs, beside formulas of the test's own.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "src/dynamics/equal_springs.h"
#include "test/friction/systems/space_box.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kBoxLength = 0.5, kBoxWidth = 0.4, kBoxHeight = 0.3, kBoxMass = 2,
                 kBoxFriction = 0.3;

std::unique_ptr<MechanicalSystem> SlidingBox(double friction = kBoxFriction) {
  return MakeSystem<test::SpaceBox>({{"height", kBoxHeight}, {"friction", friction}});
}

/// The horizontal motion (x, y, yaw, v_x, v_y, yaw rate).
using Plane = Eigen::Matrix<double, 6, 1>;

Vector StateOf(const Plane& plane, double height, double fall) {
  Vector x = Vector::Zero(15);
  x.head(2) = plane.head(2);
  x(2) = height;
  x(3) = std::cos(0.5 * plane(2));
  x(6) = std::sin(0.5 * plane(2));
  x.segment(8, 2) = plane.segment(3, 2);
  x(10) = -fall;
  x(13) = plane(5);
  x(14) = 1;
  return x;
}

Plane PlaneOf(const Vector& x) {
  Plane plane;
  plane << x(0), x(1), 2 * std::atan2(x(6), x(3)), x(8), x(9), x(13);
  return plane;
}

/// Force in x and y and the torque about the vertical of four corners whose normal forces are
/// total/4 + c·r, where the slip of the motion has the direction d at each: moments about the
/// horizontal axes vanish, Σ r λ = −(h/2) F.
Eigen::Vector3d FrictionAlong(const Plane& plane, const Plane& slip, double total, double friction,
                              double* least) {
  Eigen::Matrix2d turn = Eigen::Rotation2Dd(plane(2)).toRotationMatrix();
  Eigen::Matrix<double, 2, 4> r, d;
  r << -kBoxLength, kBoxLength, -kBoxLength, kBoxLength,  //
      -kBoxWidth, -kBoxWidth, kBoxWidth, kBoxWidth;
  r = 0.5 * turn * r;
  for (int i = 0; i < 4; ++i) {
    d.col(i) = slip.segment<2>(3) + slip(5) * Eigen::Vector2d(-r(1, i), r(0, i));
    d.col(i).normalize();
  }
  const double arm = 0.5 * kBoxHeight * friction;
  const Eigen::Matrix2d balance = r * r.transpose() - arm * d * r.transpose();
  const Eigen::Vector2d c = balance.inverse() * (arm * 0.25 * total * d.rowwise().sum());
  const Eigen::RowVector4d share = (c.transpose() * r).array() + 0.25 * total;
  *least = share.minCoeff();
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d f = -friction * share(i) * d.col(i);
    force += Eigen::Vector3d(f(0), f(1), r(0, i) * f(1) - r(1, i) * f(0));
  }
  return force;
}

Plane Accelerated(const Plane& plane, const Eigen::Vector3d& force) {
  const double inertia = kBoxMass * (kBoxLength * kBoxLength + kBoxWidth * kBoxWidth) / 12;
  Plane change = Plane::Zero();
  change << plane.tail<3>(), force(0) / kBoxMass, force(1) / kBoxMass, force(2) / inertia;
  return change;
}

TEST(TurningFace, SlidesAsOnEqualSprings) {
  const auto system = SlidingBox();
  Plane plane;
  plane << 0, 0, 0.3, 1.2, 0.4, 5;
  const double duration = 0.15;
  const Trajectory run =
      Simulate(*system, StateOf(plane, 0.5 * kBoxHeight, 0), Vector::Zero(3), duration, [] {
        SimulateOptions options;
        options.relative_tolerance = options.absolute_tolerance = 1e-12;
        return options;
      }());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.arcs.size());
  EXPECT_EQ("llll", run.arcs[0].mode.Word(4));
  ASSERT_EQ(1u, run.warnings.size());
  EXPECT_EQ(Outcome::kIndeterminateForces, run.warnings[0].code);
  const auto field = [](const Plane& at) {
    double least;
    const Eigen::Vector3d force = FrictionAlong(at, at, kBoxMass * kGravity, kBoxFriction, &least);
    EXPECT_GT(least, 0);
    return Accelerated(at, force);
  };
  constexpr int kSteps = 2000;
  for (int k = 0; k < kSteps; ++k) {  // the classical method of Runge and Kutta
    const double h = duration / kSteps;
    const Plane a = field(plane), b = field(plane + 0.5 * h * a), c = field(plane + 0.5 * h * b),
                e = field(plane + h * c);
    plane += h / 6 * (a + 2 * b + 2 * c + e);
  }
  EXPECT_LT((PlaneOf(run.FinalState()) - plane).cwiseAbs().maxCoeff(), 1e-10);
  const BDerivative B = DifferentiateOutcome(*system, run);
  EXPECT_EQ(Outcome::kIndeterminateForces, B.status.outcome) << B.status.message;
}

TEST(TurningFace, LandsAsOnEqualSprings) {
  const double friction = 0.1;
  const auto system = SlidingBox(friction);
  Plane before;
  before << 0, 0, 0.2, 1, -0.3, 4;
  const double height = 1e-3;
  const Trajectory run =
      Simulate(*system, StateOf(before, 0.5 * kBoxHeight + height, 1), Vector::Zero(3), 2e-3, {});
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ("llll", run.transitions[0].mode_after.Word(4));
  EXPECT_EQ(Outcome::kIndeterminateForces, run.transitions[0].obstacle.outcome);
  EXPECT_LT(run.transitions[0].energy_change, 0);
  const Vector& hit = run.transitions[0].x_minus;
  before = PlaneOf(hit);
  // v⁺ = v⁻ + the impulses against the slip of v⁺.
  Plane after = before;
  double least = 0;
  for (int k = 0; k < 200; ++k) {
    const Eigen::Vector3d impulse =
        FrictionAlong(before, after, -kBoxMass * hit(10), friction, &least);
    after.tail<3>() = before.tail<3>() + Accelerated(before, impulse).tail<3>();
  }
  EXPECT_GT(least, 0);
  EXPECT_LT((PlaneOf(run.transitions[0].x_plus) - after).tail<3>().cwiseAbs().maxCoeff(), 1e-10);
}

/// A push at the floor and a twist that begin at t = 0.1 make it slide and turn: a landing's words.
TEST(TurningFace, IsToldOfAtAnInputChange) {
  const auto system =
      MakeSystem<test::SpaceBox>({{"height", kBoxHeight}, {"friction", kBoxFriction}, {"arm", 0}});
  Vector push(3);
  push << 30, 5, 20;
  const Trajectory run = Simulate(*system, StateOf(Plane::Zero(), 0.5 * kBoxHeight, 0),
                                  {{0, 0.1}, {Vector::Zero(3), push}}, 0.12, {});
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_LE(1u, run.transitions.size());
  const Status& obstacle = run.transitions[0].obstacle;
  ASSERT_EQ(Outcome::kIndeterminateForces, obstacle.outcome) << obstacle.message;
  const auto told = [&](const Warning& warning) { return warning.message == obstacle.message; };
  EXPECT_TRUE(std::any_of(run.warnings.begin(), run.warnings.end(), told));
}

/// Random rigid faces of four corners under random inertia that are about to land.
FrictionProblem RandomFaces(int faces, std::mt19937* generator) {
  std::normal_distribution<double> normal;
  const int d = 6 * faces + 6;
  Matrix R(d, d), A = Matrix::Zero(12 * faces, d);
  for (double& entry : R.reshaped()) entry = normal(*generator);
  FrictionProblem problem;
  for (int corner = 0; corner < 4 * faces; ++corner) {
    const Eigen::Vector3d r((corner & 1) != 0 ? 1.2 : -0.5, (corner & 2) != 0 ? 0.3 : -0.3, -0.35);
    Eigen::Matrix<double, 3, 6> velocity;
    velocity << Eigen::Matrix3d::Identity(),
        (Eigen::Matrix3d() << 0, r(2), -r(1), -r(2), 0, r(0), r(1), -r(0), 0).finished();
    const int place = 6 * (corner / 4);
    A.block<1, 6>(3 * corner, place) = velocity.row(2);
    A.block<2, 6>(3 * corner + 1, place) = velocity.topRows<2>();
    FrictionContact contact;
    contact.coefficient = 0.8;
    contact.dimension = 2;
    problem.contacts.push_back(contact);
  }
  problem.G = A * (R * R.transpose() / d + 0.1 * Matrix::Identity(d, d)) * A.transpose();
  Vector v(d);
  for (double& entry : v) entry = normal(*generator);
  for (int face = 0; face < faces; ++face) v(6 * face + 2) -= 2;
  problem.b = A * v;
  return problem;
}

/// Random rigid faces of four corners, one or two of them, under random inertia: (F4) holds, and
/// forces on faces that are closed are those of springs, affine in the corners' places.
TEST(TurningFace, EqualSpringsSolveTheProblem) {
  std::mt19937 generator(7);
  int solved = 0, turning = 0;
  constexpr int kProblems = 100;
  for (int trial = 0; trial < kProblems; ++trial) {
    const int faces = 1 + trial % 2;
    const FrictionProblem problem = RandomFaces(faces, &generator);
    const std::optional<FrictionSolution> s = SolveEqualSprings(problem);
    if (!s) continue;
    ++solved;
    const Vector y = problem.G * s->force + problem.b;
    const double size = problem.b.cwiseAbs().maxCoeff();
    for (int i = 0; i < 4 * faces; ++i) {
      const double n = s->force(3 * i);
      const Eigen::Vector2d t = s->force.segment<2>(3 * i + 1), slip = y.segment<2>(3 * i + 1);
      EXPECT_GT(n, -1e-8 * size) << trial;
      EXPECT_GT(y(3 * i), -1e-8 * size) << trial;
      EXPECT_LT(std::abs(n * y(3 * i)), 1e-8 * size * size) << trial;
      EXPECT_LT(t.norm(), 0.8 * n + 1e-8 * size) << trial;
      EXPECT_LT(std::abs(t.dot(slip) + 0.8 * n * slip.norm()), 1e-8 * size * size) << trial;
    }
    for (int face = 0; face < faces; ++face) {
      bool closed = true, slips = true;
      for (int k = 0; k < 4; ++k) {
        closed = closed && s->letters[4 * face + k] != Letter::kOpen;
        slips = slips && s->letters[4 * face + k] == Letter::kSlip;
      }
      if (!closed) continue;
      turning += slips;
      const auto n = [&](int k) { return s->force(12 * face + 3 * k); };
      EXPECT_LT(std::abs(n(0) - n(1) - n(2) + n(3)), 1e-6 * s->force.cwiseAbs().maxCoeff())
          << trial;
    }
  }
  EXPECT_GE(solved, kProblems - 2);
  EXPECT_GT(turning, 5);
}

/// A face that is closed at three corners, two of which stick, sticks at all four: equal springs
/// let go of one, or reach the cone of another, without any motion.
TEST(TurningFace, ACornerOfAFaceThatSticksDoesNotSlip) {
  std::mt19937 generator(11);
  int stuck = 0;
  for (int trial = 0; trial < 100; ++trial) {
    for (const FrictionSolution& s : SolveFriction(RandomFaces(2, &generator))) {
      for (int face = 0; face < 2; ++face) {
        int closed = 0, sticking = 0;
        for (int k = 0; k < 4; ++k) {
          closed += s.letters[4 * face + k] != Letter::kOpen;
          sticking += s.letters[4 * face + k] == Letter::kStick;
        }
        if (closed < 3 || sticking < 2) continue;
        ++stuck;
        EXPECT_EQ(4, sticking) << trial << ' ' << face;
        EXPECT_LT(s.result.segment<12>(12 * face).norm(), 1e-7) << trial << ' ' << face;
      }
    }
  }
  EXPECT_GT(stuck, 8);
}

}  // namespace
}  // namespace contact_flow
