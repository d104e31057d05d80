// SPDX-License-Identifier: BSD-3-Clause
// More contacts that feel each other than all words are tried of.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "contact_flow/dynamics/friction_problem.h"
#include "src/dynamics/searched_words.h"
#include "test/friction/contact_law.h"
#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace {

using test::Make;
using test::Missed;
using test::Tight;

constexpr double kWeightOfOne = 9.81;

/// A disc of 1 kg, 0.05 m above `count` points on a circle about its centre.
RobotSystem PlateOf(int count, double friction) {
  const std::string urdf =
      "<robot name=\"plate\"><link name=\"plate\"><inertial><mass value=\"1\"/><inertia "
      "ixx=\"0.02\" iyy=\"0.02\" izz=\"0.04\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
      "</robot>";
  std::ostringstream yaml;
  yaml.precision(17);
  yaml << "base: floating\nnominal: {positions: {base_z: 0.15}}\nconstraints:\n";
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * M_PI * k / count;
    yaml << "  c" << k << ": {kind: plane, link: plate, point: [" << 0.2 * std::cos(angle) << ", "
         << 0.2 * std::sin(angle) << ", -0.05], friction: " << friction << "}\n";
  }
  return Make(urdf, yaml.str());
}

/// Three legs on two points each, u and u + Ω × e of a rod along e, that feel each other a little.
FrictionProblem LegsOnTwoPoints(unsigned seed) {
  constexpr int kLegs = 3, kOfLeg = 5, kDof = kLegs * kOfLeg;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Matrix rows = Matrix::Zero(6 * kLegs, kDof), root = Matrix::Zero(kDof, kDof + kOfLeg);
  for (int k = 0; k < kLegs; ++k) {
    Eigen::Vector3d rod;  // normal, tangential
    for (double& entry : rod) entry = normal(random);
    rod(0) *= 0.1;
    const Eigen::Vector3d across = rod.unitOrthogonal();
    rows.block<3, 3>(6 * k, kOfLeg * k).setIdentity();
    rows.block<3, 3>(6 * k + 3, kOfLeg * k).setIdentity();
    rows.block<3, 1>(6 * k + 3, kOfLeg * k + 3) = across;
    rows.block<3, 1>(6 * k + 3, kOfLeg * k + 4) = rod.normalized().cross(across);
    for (double& entry : root.block<kOfLeg, kOfLeg>(kOfLeg * k, kOfLeg * k).reshaped()) {
      entry = normal(random);
    }
  }
  for (double& entry : root.rightCols<kOfLeg>().reshaped()) entry = 0.3 * normal(random);
  const Matrix gain = root * root.transpose() + 0.1 * Matrix::Identity(kDof, kDof);
  FrictionProblem problem;
  problem.G = rows * gain * rows.transpose();
  Vector pull(kDof);
  for (int j = 0; j < kDof; ++j) pull(j) = 10 * normal(random) - (j % kOfLeg == 0 ? 15 : 0);
  problem.b = rows * pull;
  for (int k = 0; k < 2 * kLegs; ++k) {
    FrictionContact contact;
    contact.coefficient = 0.8;
    contact.dimension = 2;
    contact.slips = k % 2 == 0 && uniform(random) < 0.5;
    const double angle = 2 * M_PI * uniform(random);
    if (contact.slips) contact.direction = {std::cos(angle), std::sin(angle)};
    problem.contacts.push_back(contact);
  }
  return problem;
}

/// Contacts that stick to each other, with independent rows.
FrictionProblem Coupled(unsigned seed, int count, int dimension, double coupling) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  const int rows = count * (1 + dimension);
  FrictionProblem problem;
  Matrix A = Matrix::Zero(rows, rows + 4);
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < A.cols(); ++k) A(i, k) = coupling * normal(generator) / std::sqrt(rows);
    A(i, i) += 1;
  }
  problem.G = A * A.transpose();
  problem.b.resize(rows);
  for (int i = 0; i < rows; ++i) {
    problem.b(i) = normal(generator) - (i % (1 + dimension) == 0 ? 1 : 0);
  }
  const double friction = 0.1 + 0.02 * (seed % 40);
  for (int i = 0; i < count; ++i) problem.contacts.push_back({friction, dimension});
  return problem;
}

/// What is searched is what is found by trying all words.
TEST(CoupledContacts, SearchedWordsAreThoseOfAll) {
  int only = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    const FrictionProblem problem = Coupled(seed, 5, 1, 0.5);
    const auto all = SolveFriction(problem);
    const auto found = SearchWords(problem, 1e-11, 1e-7, {});
    ASSERT_FALSE(found.empty());
    for (const FrictionSolution& one : found) {
      EXPECT_LT(Missed(problem, one), 1e-9);
      EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const FrictionSolution& other) {
        return other.letters == one.letters &&
               (other.force - one.force).norm() <= 1e-9 * (1 + one.force.norm());
      }));
    }
    if (found.front().springs) continue;
    EXPECT_EQ(all.size(), found.size());
    ++only;
  }
  EXPECT_GT(only, 10);
}

/// A contact right between two letters has both.
TEST(CoupledContacts, WordsThatMeetAreAllListed) {
  for (const int count : {6, 12}) {
    FrictionProblem problem = Coupled(3, count, 1, 0.1);
    for (FrictionContact& contact : problem.contacts) contact.coefficient = 0.8;
    FrictionSolution at = SolveFriction(problem).front();
    ASSERT_FALSE(at.springs);
    // The first contact neither presses nor rises.
    Vector force = at.force;
    force.head(2).setZero();
    problem.b += at.result - (problem.G * force + problem.b);
    problem.b(0) -= at.result(0);
    problem.b(1) += 0.3 - at.result(1);
    const auto all = SolveFriction(problem);
    ASSERT_EQ(2u, all.size()) << count;
    EXPECT_FALSE(all[0].springs);
    for (const Letter letter : {Letter::kOpen, Letter::kForward}) {
      EXPECT_TRUE(std::any_of(all.begin(), all.end(),
                              [&](const auto& word) { return word.letters[0] == letter; }));
    }
  }
}

/// Many in space: a solution is found, fits, and in a time that does not grow with the words.
TEST(CoupledContacts, ManyInSpaceAreDecided) {
  for (const int count : {9, 16, 32}) {
    int only = 0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      SCOPED_TRACE(seed + 100 * count);
      const FrictionProblem problem = Coupled(seed, count, 2, 0.3);
      const auto all = SolveFriction(problem);
      ASSERT_FALSE(all.empty());
      for (const FrictionSolution& one : all) EXPECT_LT(Missed(problem, one), 1e-9);
      only += all.size() == 1 && !all.front().springs;
    }
    EXPECT_GT(only, 0) << count;
  }
  EXPECT_THROW(SolveFriction(Coupled(1, 33, 2, 0.3)), std::domain_error);
}

/// A disc lands flat with a speed along the floor, whose friction takes μ of the impulse: it goes
/// on with v − μ √(2 g h), and stops. It ended with NON_FINITE on more than eight points.
TEST(CoupledContacts, PlateLandsSlidesAndStops) {
  constexpr double kFriction = 0.3, kSpeed = 1.2, kDrop = 0.1;
  const double fall = std::sqrt(2 * kDrop / kWeightOfOne);
  const double after = kSpeed - kFriction * kWeightOfOne * fall;
  const double stop = after / (kFriction * kWeightOfOne);
  const double way = kSpeed * fall + after * stop / 2;
  for (const int count : {9, 12, 16}) {
    SCOPED_TRACE(count);
    const RobotSystem plate = PlateOf(count, kFriction);
    Vector x = plate.nominal().x;
    x(7) = kSpeed;
    const Trajectory run = Simulate(plate, x, Vector::Zero(0), fall + stop + 0.1, Tight());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_NEAR(way, run.FinalState()(0), 1e-8);
    EXPECT_NEAR(0.05, run.FinalState()(2), 1e-9);
    EXPECT_LT(run.FinalState().tail(6).norm(), 1e-8);
  }
}

/// A start on all points, which stick; and the load is on all.
TEST(CoupledContacts, PlateStands) {
  const RobotSystem plate = PlateOf(16, 0.8);
  Vector x = plate.nominal().x;
  x(2) = 0.05;
  const Trajectory run = Simulate(plate, x, Vector::Zero(0), 0.5, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ(16, run.arcs.back().mode.Sticking().Size());
  EXPECT_LT((run.FinalState() - x).cwiseAbs().maxCoeff(), 1e-10);
}

/// Twirled on a circle of points friction takes μ m g r of the spin.
TEST(CoupledContacts, PlateTurnsAndStops) {
  constexpr double kFriction = 0.2, kSpin = 3, kTurn = 0.04;
  const double slow = kFriction * kWeightOfOne * 0.2 / kTurn, stop = kSpin / slow;
  const RobotSystem plate = PlateOf(12, kFriction);
  Vector x = plate.nominal().x;
  x(2) = 0.05;
  x(plate.num_positions() + 5) = kSpin;
  const Trajectory run = Simulate(plate, x, Vector::Zero(0), stop + 0.1, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const double angle = 2 * std::atan2(run.FinalState()(6), run.FinalState()(3));
  EXPECT_NEAR(kSpin * stop / 2, angle, 1e-8);
  EXPECT_LT(run.FinalState().tail(6).norm(), 1e-8);
}

/// Where equal springs under all of them find nothing, a word that fits is found all the same.
TEST(CoupledContacts, OnTwoPointsOfEachLegHaveForces) {
  int solved = 0;
  for (unsigned seed = 241; seed <= 260; ++seed) {
    SCOPED_TRACE(seed);
    const FrictionProblem problem = LegsOnTwoPoints(seed);
    const std::vector<FrictionSolution> found = SolveFriction(problem);
    for (const FrictionSolution& one : found) EXPECT_LT(Missed(problem, one), 1e-8);
    solved += !found.empty();
  }
  EXPECT_EQ(20, solved);
}

}  // namespace
}  // namespace contact_flow
