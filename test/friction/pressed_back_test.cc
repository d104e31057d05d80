// SPDX-License-Identifier: BSD-3-Clause
// Feet that the impacts of others throw up so little that they are pressed back at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
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

/// Derivatives of the usual tolerance, which takes rises of 1e-5 m/s to rest, beside quotients of
/// runs at 1e-12, which resolve most of these.
TEST_F(PressedBack, DerivativesAreThoseOfBouncesThatAreResolved) {
  int rested = 0, confirmed = 0;
  for (int seed = 1; seed <= 6; ++seed) {
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
    EXPECT_LT(report.samples.back().error, 1e-4 * B(w).norm())
        << report.samples[0].error << ' ' << report.samples[1].error;
    ++confirmed;
  }
  EXPECT_GE(rested, 4);
  EXPECT_GE(confirmed, 4);
}

}  // namespace
}  // namespace contact_flow
