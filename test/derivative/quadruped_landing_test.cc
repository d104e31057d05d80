// SPDX-License-Identifier: BSD-3-Clause
// The quadruped with sprung feet dropped flat: four touchdowns at once, in 24 orders.
#include <gtest/gtest.h>

#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

class QuadrupedLanding : public testing::Test {
 protected:
  QuadrupedLanding() : system(LoadRobot(RobotFile("compliant_quadruped"))) {
    options.relative_tolerance = options.absolute_tolerance = 1e-11;
    derivative_options.tolerance = 1e-10;
    const NominalRun& nominal = system->nominal();
    run = Simulate(*system, nominal.x, nominal.u, kDuration, options);
  }
  /// A unit direction in which the feet land in an order of their own.
  Vector Direction() {
    std::normal_distribution<double> normal;
    Vector w(2 * system->dof());
    for (Eigen::Index i = 0; i < w.size(); ++i) w(i) = normal(generator);
    return w.normalized();
  }

  static constexpr double kDuration = 0.13;  // [s] 0.113 of fall
  std::unique_ptr<RobotSystem> system;
  SimulateOptions options;
  BDerivativeOptions derivative_options;
  Trajectory run;
  std::mt19937 generator{4};
};

TEST_F(QuadrupedLanding, FourFeetLandAtOnceAndOrthogonally) {
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(ConstraintSet({0, 1, 2, 3}), run.transitions[0].activated);
  // Free fall from the nominal height, the soles' and legs' springs slack: t = √(2 gap / g).
  ConstraintTerms terms;
  system->Constraints(system->nominal().x.head(system->num_positions()),
                      Vector::Zero(system->dof()), &terms);
  EXPECT_NEAR(std::sqrt(2 * terms.gap(0) / 9.81), run.transitions[0].t, 1e-10);
}

TEST_F(QuadrupedLanding, HasAPieceForEachOrder) {
  const BDerivative B = DifferentiateOutcome(*system, run, derivative_options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const PiecewiseLinearMap map = B.Pieces();
  EXPECT_EQ(24u, map.pieces().size());
  for (int k = 0; k < 20; ++k) {
    const Vector w = Direction();
    EXPECT_LE((map(w) - B(w)).cwiseAbs().maxCoeff(), 1e-8 * B(w).cwiseAbs().maxCoeff());
  }
}

/// One-sided quotients (φ(x ⊞ αw) ⊟ φ(x))/α − B(w) are O(α): over a decade of α the error falls by
/// a decade.
TEST_F(QuadrupedLanding, OneSidedQuotientsConvergeWithSlopeOne) {
  const BDerivative B = DifferentiateOutcome(*system, run, derivative_options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  options.simultaneity_tolerance = 1e-11;
  const Vector end = run.FinalState();
  for (int k = 0; k < 4; ++k) {
    const Vector w = Direction(), expected = B(w);
    double error[2];
    for (int i = 0; i < 2; ++i) {
      const double alpha = i == 0 ? 1e-4 : 1e-5;
      const Trajectory near = Simulate(*system, system->Perturb(system->nominal().x, alpha * w),
                                       system->nominal().u, kDuration, options);
      ASSERT_TRUE(near.status.ok()) << near.status.message;
      const Vector quotient = system->Separation(near.FinalState(), end) / alpha;
      error[i] = (quotient - expected).norm() / expected.norm();
    }
    EXPECT_LE(error[1], 1e-2);
    const double slope = std::log10(error[0] / error[1]);
    EXPECT_NEAR(1, slope, 0.1) << error[0] << ' ' << error[1];
  }
}

}  // namespace
}  // namespace contact_flow
