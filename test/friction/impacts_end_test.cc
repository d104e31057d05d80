// SPDX-License-Identifier: BSD-3-Clause
// Plastic impacts of bodies that may all slip end, whatever their friction is (D. E. Stewart,
// Rigid-body dynamics with friction and impact, SIAM Review 42, 2000): a solution is found, and
// fulfils (F4).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <random>
#include <vector>

#include "contact_flow/dynamics/friction_problem.h"
#include "test/friction/contact_law.h"

namespace contact_flow {
namespace {

using test::Missed;

/// Of (F4), relative to the largest rate: of forces that are shared as by springs; of one word.
constexpr double kOfShares = 1e-4, kOfWord = 1e-8;
/// Rates below this are rounding of velocities of 1: all contacts hold all bodies.
constexpr double kHeld = 1e-9;

/// One or two bodies with contacts at random points, in a random kinetic metric. One is hit, most
/// of the others touch without speed, and half of these stick.
FrictionProblem RandomImpact(unsigned seed, int count) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const int bodies = 1 + seed % 2, d = 6 * bodies + static_cast<int>(4 * uniform(random));
  Matrix root(d, d);
  for (double& entry : root.reshaped()) entry = normal(random);
  const Matrix inverse = root * root.transpose() + 1e-3 * Matrix::Identity(d, d);
  std::vector<Matrix> twists(bodies, Matrix(6, d));
  for (Matrix& twist : twists) {
    for (double& entry : twist.reshaped()) entry = normal(random);
  }
  FrictionProblem problem;
  const double coefficient = 2 * uniform(random), thickness = seed % 4 < 2 ? 0 : 1;
  const int hit = static_cast<int>(count * uniform(random));
  Matrix rows(3 * count, d);
  std::vector<int> still;
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d r(normal(random), normal(random), thickness * normal(random));
    Eigen::Matrix3d cross;
    cross << 0, -r(2), r(1), r(2), 0, -r(0), -r(1), r(0), 0;
    const Matrix& twist = twists[static_cast<std::size_t>(k % bodies)];
    const Matrix velocity = twist.topRows(3) - cross * twist.bottomRows(3);
    rows.row(3 * k) = velocity.row(2);
    rows.middleRows(3 * k + 1, 2) = velocity.topRows(2);
    problem.contacts.push_back({coefficient, 2});
    if (k == hit) continue;
    if (uniform(random) < 0.8) still.push_back(3 * k);
    if (uniform(random) < 0.5) still.insert(still.end(), {3 * k + 1, 3 * k + 2});
  }
  Vector v(d);
  for (double& entry : v) entry = normal(random);
  if (!still.empty()) {
    Matrix held(still.size(), d);
    for (std::size_t i = 0; i < still.size(); ++i)
      held.row(static_cast<int>(i)) = rows.row(still[i]);
    v -= held.completeOrthogonalDecomposition().solve(Vector(held * v));
  }
  problem.G = rows * inverse * rows.transpose();
  problem.b = rows * v;
  if (problem.b(3 * hit) > 0) problem.b = -problem.b;
  return problem;
}

TEST(ImpactsEnd, WhateverTheirFrictionIs) {
  int solved = 0;
  for (unsigned seed = 0; seed < 600; ++seed) {
    SCOPED_TRACE(seed);
    const FrictionProblem problem = RandomImpact(seed, 1 + static_cast<int>(seed % 6));
    if (problem.b.cwiseAbs().maxCoeff() < kHeld) continue;
    const std::vector<FrictionSolution> all = SolveFriction(problem);
    EXPECT_FALSE(all.empty());
    for (const FrictionSolution& found : all) EXPECT_LE(Missed(problem, found), kOfShares);
    ++solved;
  }
  EXPECT_LT(500, solved);
}

/// Two corners of a humanoid's foot and one of the other, which slide: 1e-5 m/s of approach are
/// answered by 3e-2 m/s of slip, and none of the starts of a search led there.
TEST(ImpactsEnd, NearlyJammed) {
  FrictionProblem problem;
  problem.G.resize(9, 9);
  problem.G << 2.2288836869, -0.0534271141, 0.3814045790, -3.3993041772, 0.5645638787,
      -1.1412740836, -0.0052610647, 0.0041522639, -0.0022038159,  //
      -0.0534271141, 0.8352737614, -0.0118484034, 0.8605870683, 0.6327907202, 0.4870530530,
      0.0006210678, -0.0020224898, 0.0029305109,  //
      0.3814045790, -0.0118484034, 0.8526541110, -0.9428464294, 0.3063313513, 0.0686855275,
      -0.0016987181, 0.0031436007, -0.0038914869,  //
      -3.3993041772, 0.8605870683, -0.9428464294, 6.5314470799, -0.3032429017, 1.9247343004,
      0.0032496461, 0.0003449960, -0.0035974986,  //
      0.5645638787, 0.6327907202, 0.3063313513, -0.3032429017, 0.7640096494, -0.0169812296,
      0.0033065152, 0.0001385878, -0.0032903180,  //
      -1.1412740836, 0.4870530530, 0.0686855275, 1.9247343004, -0.0169812296, 1.3105842869,
      -0.0083154381, -0.0021811157, 0.0114361206,  //
      -0.0052610647, 0.0006210678, -0.0016987181, 0.0032496461, 0.0033065152, -0.0083154381,
      5.1353545282, -0.4761512393, 3.0013129615,  //
      0.0041522639, -0.0020224898, 0.0031436007, 0.0003449960, 0.0001385878, -0.0021811157,
      -0.4761512393, 0.8538515632, -0.2344067483,  //
      -0.0022038159, 0.0029305109, -0.0038914869, -0.0035974986, -0.0032903180, 0.0114361206,
      3.0013129615, -0.2344067483, 2.5689597168;
  problem.b.resize(9);
  problem.b << -1.1340871506e-5, 0.0789824718, -0.0030070749, 0, 0.1989411843, -0.2985754150, 0,
      4.5709924099, -1.1610387483;
  problem.contacts.assign(3, {0.8, 2});
  const std::vector<FrictionSolution> all = SolveFriction(problem);
  ASSERT_EQ(1u, all.size());
  EXPECT_LE(Missed(problem, all.front()), kOfWord);
  EXPECT_GT(all.front().force(0), 0.1);
}

}  // namespace
}  // namespace contact_flow
