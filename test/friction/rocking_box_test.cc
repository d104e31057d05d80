// SPDX-License-Identifier: BSD-3-Clause
// Boxes that rock from edge to edge, or clatter on their corners, until they rest: nothing slides
// on, and no motion is left.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/friction/confirmed.h"
#include "test/friction/systems/flat_box.h"
#include "test/friction/systems/space_box.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::kGravity;

constexpr double kBlockMass = 2;

/// With its lowest corner on the floor.
Vector OnTheFloor(const MechanicalSystem& system, Vector x, int height) {
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  x(height) -= terms.gap.minCoeff();
  return x;
}

bool WarnsOfZeno(const Trajectory& run) {
  for (const Warning& warning : run.warnings) {
    if (warning.code == Outcome::kZeno) return true;
  }
  return false;
}

/// Housner's block: each impact leaves r² of the energy, r = 1 − (3/2) sin²α, tan α = width/height,
/// as angular momentum about the edge that hits is kept. All of what is lost is told.
TEST(RockingBox, RocksToRestInThePlane) {
  for (const double height : {0.3, 0.4, 0.5, 0.8}) {
    const auto system = MakeSystem<test::FlatBox>({{"height", height}, {"friction", 1.5}});
    Vector x = Vector::Zero(8);
    x(2) = 0.1;
    x = OnTheFloor(*system, x, 1);
    const double fallen = kBlockMass * kGravity * (x(1) - 0.5 * height);
    const Trajectory run = Simulate(*system, x, Vector::Zero(1), 3);
    ASSERT_TRUE(run.status.ok()) << height << ": " << run.status.message;
    EXPECT_EQ("ss", run.arcs.back().mode.Word(2));
    EXPECT_LT(run.FinalState().tail(4).norm(), 1e-9);
    EXPECT_NEAR(0.5 * height, run.FinalState()(1), 1e-9);
    const double sine = 0.16 / (0.16 + height * height), r = 1 - 1.5 * sine;
    ASSERT_GE(run.transitions.size(), 3u);
    double left = fallen, told = 0;
    for (const Transition& transition : run.transitions) {
      told += transition.energy_lost - transition.energy_change;
      if (left < 1e-3 * fallen || transition.activated.Empty()) continue;
      EXPECT_NEAR((r * r - 1) * left, transition.energy_change, 1e-6 * fallen) << height;
      left *= r * r;
    }
    EXPECT_NEAR(fallen, told, 1e-6 * fallen) << height;
    EXPECT_TRUE(WarnsOfZeno(run)) << height;
    // A derivative, where there is one, is that of all impacts, of which the run has the first.
    SimulateOptions options;
    options.dense = true;
    const Trajectory dense = Simulate(*system, x, Vector::Zero(1), 3, options);
    const BDerivative B = DifferentiateOutcome(*system, dense);
    EXPECT_TRUE(B.status.ok() || height > 0.3) << B.status.message;
    if (!B.status.ok()) continue;
    const Vector w = ProjectAdmissible(*system, x, dense.arcs[0].mode,
                                       test::Entries({0.1, 0, 0, 0, 0.3, 0.1, -0.2, 0}));
    const Vector predicted = B(w);
    test::ExpectConfirmed(
        CompareWithQuotients(*system, x, Vector::Zero(1), 3, w, predicted, {1e-4, 1e-5, 1e-6}), B,
        w);
  }
}

/// Elastic edges bounce each time the box falls on them: what accumulates is a pattern of impacts.
TEST(RockingBox, RocksAndBouncesToRest) {
  for (const double restitution : {0.05, 0.2, 0.4}) {
    for (const double height : {0.4, 0.8}) {
      SCOPED_TRACE(testing::Message() << restitution << ", " << height);
      const auto system = MakeSystem<test::FlatBox>(
          {{"height", height}, {"friction", 1.5}, {"restitution", restitution}});
      Vector x = Vector::Zero(8);
      x(2) = 0.1;
      x = OnTheFloor(*system, x, 1);
      SimulateOptions options;
      options.complete_zeno = true;
      const Trajectory run = Simulate(*system, x, Vector::Zero(1), 4, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ("ss", run.arcs.back().mode.Word(2));
      EXPECT_LT(run.FinalState().tail(4).norm(), 1e-9);
      EXPECT_NEAR(0.5 * height, run.FinalState()(1), 1e-8);
      EXPECT_LT(run.transitions.size(), 250u);
    }
  }
}

/// Let go on a corner, or an edge: it hits with others in turns, on one edge or all round.
TEST(RockingBox, ClattersToRestInSpace) {
  for (int seed = 0; seed < 16; ++seed) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const double friction = 0.6 + 0.4 * std::abs(uniform(generator));
    const double height = 0.2 + 0.3 * std::abs(uniform(generator));
    const double tilt = 0.02 + 0.15 * std::abs(uniform(generator));
    const double axis = seed % 3 == 0 ? 0.5 * M_PI : M_PI * uniform(generator);
    const auto system = MakeSystem<test::SpaceBox>({{"friction", friction}, {"height", height}});
    Vector x = Vector::Zero(15);
    x.segment(3, 4) << std::cos(0.5 * tilt), std::cos(axis) * std::sin(0.5 * tilt),
        std::sin(axis) * std::sin(0.5 * tilt), 0;
    x = OnTheFloor(*system, x, 2);
    SimulateOptions options;
    options.method = IntegrationMethod::kAutomatic;
    const Trajectory run = Simulate(*system, x, Vector::Zero(3), 1.5, options);
    ASSERT_TRUE(run.status.ok()) << seed << ": " << run.status.message;
    EXPECT_EQ("ssss", run.arcs.back().mode.Word(4)) << seed;
    EXPECT_LT(run.FinalState().segment(8, 6).norm(), 1e-8) << seed;
    EXPECT_NEAR(0.5 * height, run.FinalState()(2), 1e-8) << seed;
    const double fallen = kBlockMass * kGravity * (x(2) - 0.5 * height);
    double lost = 0;
    for (const Transition& transition : run.transitions) {
      EXPECT_LE(transition.energy_change, 0) << seed;
      EXPECT_GE(transition.energy_lost, 0) << seed;
      lost += transition.energy_lost;
    }
    EXPECT_LT(lost, 1e-6 * fallen) << seed;
  }
}

/// Signorini's law behind each impact of a run: what was hit, or held, does not approach.
void ExpectNoneApproaches(const MechanicalSystem& system, const Trajectory& run) {
  const int nq = system.num_positions(), d = system.dof();
  ConstraintTerms terms;
  for (const Transition& event : run.transitions) {
    if (event.activated.Empty()) continue;
    const Vector v = event.x_plus.tail(d);
    system.Constraints(event.x_plus.head(nq), v, &terms);
    for (int i : event.activated | event.mode_before) {
      const auto row = terms.jacobian.row(i);
      const Vector size = v.cwiseAbs().cwiseMax(event.x_minus.tail(d).cwiseAbs());
      EXPECT_GE(row.dot(v), -1e-9 * row.cwiseAbs().dot(size))
          << "contact " << i << " at " << event.t << " s, " << event.mode_before.Word(4) << " to "
          << event.mode_after.Word(4);
    }
  }
}

/// Boxes of little restitution that fall on an edge or a corner: the rest of one edge, whose rise
/// is too low to be resolved, turns back no bounce of the other.
TEST(RockingBox, RestTurnsNoBounceBack) {
  for (int seed = 0; seed < 24; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double tilt = 0.05 + 0.2 * uniform(generator), axis = 2 * M_PI * uniform(generator);
    const double restitution = seed % 2 == 0 ? 0.05 : 0.2;
    const double friction = seed % 3 == 0 ? 0 : 0.3 + 0.5 * uniform(generator);
    const auto system = MakeSystem<test::SpaceBox>(
        {{"friction", friction}, {"height", 0.3}, {"restitution", restitution}});
    Vector x = Vector::Zero(15);
    x.segment(3, 4) << std::cos(0.5 * tilt), std::cos(axis) * std::sin(0.5 * tilt),
        std::sin(axis) * std::sin(0.5 * tilt), 0;
    if (seed % 4 == 1) x.segment(3, 4) << std::cos(0.5 * tilt), std::sin(0.5 * tilt), 0, 0;
    x = OnTheFloor(*system, x, 2);
    x(2) += 0.3 * uniform(generator);
    SimulateOptions options;
    options.complete_zeno = true;
    const Trajectory run = Simulate(*system, x, Vector::Zero(3), 1.2, options);
    EXPECT_TRUE(run.status.ok()) << run.status.message;
    ExpectNoneApproaches(*system, run);
  }
}

/// The same without friction.
TEST(RockingBox, RestTurnsNoBounceBackOnIce) {
  for (const double restitution : {0.05, 0.1, 0.2, 0.3}) {
    for (int seed = 0; seed < 6; ++seed) {
      SCOPED_TRACE(testing::Message() << restitution << ", seed " << seed);
      const auto box = MakeModel("falling_box", {{"restitution", restitution}});
      std::mt19937 generator(seed);
      std::normal_distribution<double> normal;
      Vector x = box->nominal().x;
      for (Eigen::Index k = x.size() - 6; k < x.size(); ++k) x(k) = 0.5 * normal(generator);
      SimulateOptions options;
      options.complete_zeno = true;
      const Trajectory run = Simulate(*box, x, Vector::Zero(box->num_inputs()), 2, options);
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      ExpectNoneApproaches(*box, run);
    }
  }
}

/// The two corners of an edge that stick depend on each other however little the edge is turned
/// from an axis: rows along it are almost alike before the last one is reached.
TEST(RockingBox, AnEdgeIsRigidWhereverItPoints) {
  const auto system = MakeSystem<test::SpaceBox>({});
  ContactDynamics dynamics(*system, Vector::Zero(3));
  for (double yaw = 1; yaw > 1e-9; yaw *= 0.3) {
    const Eigen::Quaterniond turn =
        Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
        Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX()));
    Vector x = Vector::Zero(15);
    x.segment(3, 4) << turn.w(), turn.vec();
    x(14) = 1;
    x = OnTheFloor(*system, x, 2);
    ContactMode edge;
    for (int i : {0, 1}) edge.Set(i, Letter::kStick);
    dynamics.Evaluate(x, edge);
    EXPECT_EQ(ConstraintSet({0, 1}), dynamics.shared()) << yaw;
  }
}

}  // namespace
}  // namespace contact_flow
