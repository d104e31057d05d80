// SPDX-License-Identifier: BSD-3-Clause
// Feet that the impacts of others throw up so little that they are pressed back at once.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/turned_impulses.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "src/derivative/frictional_walk.h"
#include "src/derivative/rest_reset.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/rest_impulse.h"
#include "test/friction/systems/tips.h"
#include "test/model/random_drop.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

/// The quadruped, dropped with some velocity: legs bounce ever lower, each thrown up by others.
class PressedBack : public ::testing::Test {
 protected:
  Vector Dropped(int seed) const {
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    Vector x = robot_->nominal().x;
    auto v = x.tail(robot_->dof());
    for (int k = 0; k < 6; ++k) v(k) += (k == 2 ? 0.05 : k < 2 ? 0.6 : 0.3) * normal(random);
    return x;
  }

  const std::unique_ptr<RobotSystem> robot_ = LoadRobot(RobotFile("quadruped_friction"));
};

bool SlipsTurn(const Trajectory& run) {
  return std::any_of(run.transitions.begin(), run.transitions.end(),
                     [](const Transition& t) { return t.turned > 1e-3; });
}

/// Derivatives of the usual tolerance, which takes rises of 1e-5 m/s to rest, beside quotients of
/// runs at 1e-12, which resolve most of these.
TEST_F(PressedBack, DerivativesAreThoseOfBouncesThatAreResolved) {
  int rested = 0, confirmed = 0, turned = 0;
  for (int seed = 1; seed <= 30; ++seed) {
    SCOPED_TRACE(seed);
    const Vector x = Dropped(seed), u = robot_->nominal().u;
    const double duration = 0.02;
    SimulateOptions options;
    options.dense = true;
    const Trajectory run = Simulate(*robot_, x, u, duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const auto told = [](const Transition& t) { return t.rest_impulse.size() > 0; };
    rested += std::any_of(run.transitions.begin(), run.transitions.end(), told);
    const BDerivative B = DifferentiateOutcome(*robot_, run);
    if (!B.status.ok()) continue;
    std::mt19937 random(17);
    std::normal_distribution<double> normal;
    Vector w(2 * robot_->dof());
    for (double& entry : w) entry = normal(random);
    w.head(robot_->dof()) *= 0.1;
    const QuotientReport report =
        CompareWithQuotients(*robot_, x, u, duration, w, B(w), {1e-5, 1e-6, 1e-7});
    double error = report.samples.back().error;  // slow touchdowns blow up rounding at small steps
    for (const auto& sample : report.samples) error = std::min(error, sample.error);
    EXPECT_LT(error, 1e-4 * B(w).norm());
    if (SlipsTurn(run)) {  // and as is told
      const double told = B.Error(w).maxCoeff();
      EXPECT_LT(error, told + 1e-6 * B(w).norm());
      ++turned;
    }
    ++confirmed;
  }
  EXPECT_GE(rested, 4);
  EXPECT_GE(confirmed, 4);
  EXPECT_GE(turned, 2);
  std::printf("%d rest, %d confirmed, slips turn in %d\n", rested, confirmed, turned);
}

/// Drops of a robot on rigid feet, each of which throws up the others by some 1e-13 m: where how
/// they bounce matters, they do; feet that were thrown up together land one after the other.
TEST(RigidFeet, BouncesThatMatterAreFollowed) {
  RobotTexts texts = ReadRobotTexts(DropFile("quadruped"));
  AddFriction(0.8, &texts.yaml);
  const std::unique_ptr<RobotSystem> robot = MakeRobot(texts);
  for (const int seed : {3, 11, 14, 33, 39, 102, 109}) {
    SCOPED_TRACE(seed);
    const Vector x = RandomDrop(*robot, seed), u = robot->nominal().u;
    SimulateOptions options;
    options.method = IntegrationMethod::kAutomatic;
    const Trajectory run = Simulate(*robot, x, u, 1.0, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const BDerivative B = DifferentiateOutcome(*robot, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    Vector w(2 * robot->dof());
    for (double& entry : w) entry = normal(random);
    w.normalize();
    const Vector b = B(w);
    double error = 1;
    for (const double h : {3e-5, 1e-5, 3e-6, 1e-6, 3e-7}) {
      const Trajectory other = Simulate(*robot, robot->Perturb(x, h * w), u, 1.0, options);
      if (!other.status.ok()) continue;
      const Vector quotient = robot->Separation(other.FinalState(), run.FinalState()) / h;
      error = std::min(error, (quotient - b).norm());
    }
    const double told = B.Error(w).norm();
    EXPECT_LT(error, 1e-3 * b.norm());
    EXPECT_LT(error, told);
    std::printf("seed %d: |b| %.3g, off %.1e, told %.1e\n", seed, b.norm(), error, told);
  }
}

/// A foot that rocks makes the other, which sticks, slip at some 1e-9 m/s: in the direction of that
/// impact, not as a slip from rest begins. B(F⁻) = F⁺ tells.
TEST(RigidFeet, SlipsThatImpactsLeaveAreNotNone) {
  RobotTexts texts = ReadRobotTexts(DropFile("humanoid"));
  AddFriction(0.8, &texts.yaml);
  const std::unique_ptr<RobotSystem> robot = MakeRobot(texts);
  SimulateOptions options;
  options.method = IntegrationMethod::kAutomatic;
  const Vector x = RandomDrop(*robot, 23), u = robot->nominal().u;
  const Trajectory run = Simulate(*robot, x, u, 0.26687, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ContactDynamics dynamics(*robot, u);
  const int d = robot->dof(), nq = robot->num_positions();
  int slow = 0;
  for (const Transition& transition : run.transitions) {
    if (transition.guards.size() != 1 || transition.activated.Empty()) continue;
    if (!transition.obstacle.ok() || !transition.rested.Empty()) continue;
    ConstraintTerms terms;
    robot->Constraints(transition.x_plus.head(nq), transition.x_plus.tail(d), &terms);
    double slowest = 1;
    for (int i : transition.mode_before.Sticking() & transition.mode_after.Members()) {
      if (transition.mode_after.LetterOf(i) != Letter::kSlip) continue;
      const auto T = terms.jacobian.middleRows<2>(robot->friction()[i].row);
      slowest = std::min(slowest, (T * transition.x_plus.tail(d)).norm());
    }
    if (slowest > 1e-8) continue;
    ++slow;
    const Vector field = dynamics.Field(transition.x_minus, transition.mode_before);
    const FrictionalPath path = WalkThrough(&dynamics, transition, {}, field, Vector());
    const Vector after = dynamics.Field(transition.x_plus, transition.mode_after);
    EXPECT_LT((path.matrix * field - after).norm(), 1e-4 * after.norm()) << transition.t;
  }
  EXPECT_GE(slow, 1);
}

/// DR of a rest, with slips in space and coefficients of friction, beside differences of v⁺: speeds
/// of 1 m/s show its terms by impulses, which are tiny for the rises of runs.
TEST_F(PressedBack, ResetHasTheDerivativeOfItsVelocity) {
  const std::vector<std::string> names = {"friction", "trunk_mass"};
  Variables variables;
  Vector values(2);
  const auto& all = robot_->description().parameters;
  for (int j = 0; j < 2; ++j) {
    for (std::size_t at = 0; at < all.size(); ++at) {
      if (all[at].name != names[static_cast<std::size_t>(j)]) continue;
      variables.parameters.push_back(static_cast<int>(at));
      values(j) = all[at].value;
    }
  }
  ASSERT_EQ(2u, variables.parameters.size());
  const int d = robot_->dof(), nq = robot_->num_positions();
  const int k = 2;
  ContactMode mode;
  mode.Set(0, Letter::kSlip);
  mode.Set(1, Letter::kStick);
  mode.Set(2, Letter::kSlip);
  Vector x = robot_->nominal().x;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (double& rate : x.tail(d)) rate = normal(random);
  const ContactDynamics dynamics(*robot_, robot_->nominal().u, variables);
  const RestReset reset = ResetToRest(dynamics, x, mode);
  const auto rest = [&](const Vector& w) {
    const auto robot =
        LoadRobot(RobotFile("quadruped_friction"),
                  {{names[0], values(0) + w(2 * d)}, {names[1], values(1) + w(2 * d + 1)}});
    const Vector y = robot->Perturb(x, w.head(2 * d));
    const InverseInertia inertia(*robot, y.head(nq), y.tail(d));
    return BringToRest(*robot, inertia, y.tail(d), mode).v_plus;
  };
  EXPECT_LT((reset.v_plus - rest(Vector::Zero(2 * d + k))).norm(), 1e-12);
  constexpr double kStep = 1e-5;
  for (int j = 0; j < 2 * d + k; ++j) {
    const Vector w = kStep * Vector::Unit(2 * d + k, j);
    const Vector quotient = (rest(w) - rest(-w)) / (2 * kStep);
    const Vector told = reset.jacobian.col(j).segment(d, d);
    EXPECT_LT((quotient - told).norm(), 1e-6 * (1 + told.norm())) << "column " << j;
  }
}

/// What is told of slips that turn, beside the reset of slips that are turned: no less, and no more
/// than the directions of two slips make of it.
TEST_F(PressedBack, TurnedImpulsesCoverResetsOfTurnedSlips) {
  const int d = robot_->dof(), nq = robot_->num_positions();
  ContactMode mode;
  mode.Set(0, Letter::kSlip);
  mode.Set(1, Letter::kStick);
  mode.Set(2, Letter::kSlip);
  Vector x = robot_->nominal().x;
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (double& rate : x.tail(d)) rate = normal(random);
  const ContactDynamics dynamics(*robot_, robot_->nominal().u, Variables());
  x.tail(d) = ResetToRest(dynamics, x, mode).v_plus;  // at rest, where the reset is linear

  constexpr double kAngle = 0.05;
  const InverseInertia inertia(*robot_, x.head(nq), x.tail(d));
  std::map<int, Eigen::Vector2d> slips;
  for (int i : {0, 2}) {
    const int row = robot_->friction()[i].row;
    const Eigen::Vector2d slip = inertia.terms().jacobian.middleRows<2>(row) * x.tail(d);
    slips[i] = Eigen::Rotation2Dd(kAngle) * slip;
  }
  Vector turned = x;
  MakeRest(*robot_, mode, slips, &turned);
  const Matrix difference = ResetToRest(dynamics, turned, mode).jacobian.block(d, d, d, d) -
                            ResetToRest(dynamics, x, mode).jacobian.block(d, d, d, d);
  Transition transition;
  transition.x_minus = transition.x_plus = x;
  transition.rested = mode;
  transition.turned = kAngle;
  const TurnedImpulses impulses = FindTurnedImpulses(*robot_, transition);
  ASSERT_EQ(4, impulses.across.cols());
  const Matrix jumps =
      ResetToRest(dynamics, x, mode).jacobian.block(d, d, d, d) - Matrix::Identity(d, d);
  const auto size = [&](const Vector& v) { return std::sqrt(v.dot(inertia.mass() * v)); };
  double closest = 0;
  for (int j = 0; j < d; ++j) {
    const Vector sizes = impulses.SizesOf(jumps.col(j));
    double told = 0;
    for (int k = 0; k < 4; ++k) told += size(impulses.across.col(k)) * sizes(k);
    const double off = size(difference.col(j));
    EXPECT_LE(off, 1.05 * told + 1e-12) << "column " << j;
    if (told > 1e-9) closest = std::max(closest, off / told);
  }
  EXPECT_GT(closest, 0.2);
}

/// Three tips: an impulse on the first moves the second by 0.01, the third by `third` [1/kg]; one
/// on the second moves the third by `between`; the third falls at `pull` [m/s²].
std::unique_ptr<MechanicalSystem> CoupledTips(double third, double between, double pull) {
  Matrix reach = Matrix::Identity(6, 6);  // of x0, z0, x1, z1, x2, z2
  reach(1, 3) = reach(3, 1) = 0.01;
  reach(1, 5) = reach(5, 1) = third;
  reach(3, 5) = reach(5, 3) = between;
  const Matrix mass = reach.inverse();
  Vector free(6);
  free << 0, -10, 0, -10, 0, -pull;
  const Vector force = mass * free;
  ParameterValues values;
  for (int i = 0; i < 36; ++i) values["m" + std::to_string(i)] = mass(i / 6, i % 6);
  for (int i = 0; i < 6; ++i) values["f" + std::to_string(i)] = force(i);
  return MakeSystem<test::Tips<3>>(values);
}

/// A landing throws up two tips that stand. Beside what has landed the second is pulled up, and
/// pressed back only by the first, once that rests again: both rest.
TEST(PressedBackOfTips, OneThatRestsPressesAnother) {
  const auto tips = CoupledTips(0.01, -0.5, -1);
  Vector x = Vector::Zero(12);
  x(1) = 1e-6;   // above the floor
  x(7) = -5e-3;  // its rate
  const Trajectory run = Simulate(*tips, x, Vector(), 0.1);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ("sss", run.transitions[0].mode_after.Word(3));
}

/// The second tip is thrown up for 1e-5 s by the landing of the first, and rests meanwhile. What
/// lands in that time, as the third, would find it above the floor: that is told, and there is no
/// derivative of it.
TEST(PressedBackOfTips, OneThatIsHitBeforeItWouldBeBackIsTold) {
  const auto tips = CoupledTips(0, -0.3, 10);
  for (const double later : {3e-6, 3e-5}) {  // [s]
    Vector x = Vector::Zero(12);
    x(1) = 1e-7;  // above the floor
    x(7) = x(11) = -5e-3;
    x(5) = x(1) + 5e-3 * later;
    const Trajectory run = Simulate(*tips, x, Vector(), 1e-3);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(2u, run.transitions.size());
    EXPECT_NEAR(later, run.transitions[1].t - run.transitions[0].t, 0.2 * later);
    const bool told =
        std::any_of(run.warnings.begin(), run.warnings.end(), [](const Warning& warning) {
          return warning.code == Outcome::kDiscontinuous &&
                 warning.message.find("too slowly to be resolved, are hit together with") !=
                     std::string::npos;
        });
    EXPECT_EQ(later < 1e-5, told);
    const BDerivative B = DifferentiateOutcome(*tips, run);
    EXPECT_EQ(later < 1e-5, B.status.outcome == Outcome::kDiscontinuous) << B.status.message;
  }
}

}  // namespace
}  // namespace contact_flow
