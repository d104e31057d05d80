// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/variation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/reference_case.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Φ of a free run (no events) at one tolerance for run and tangents.
Matrix FreeFlight(const MechanicalSystem& system, const Vector& x, double duration,
                  double tolerance, VariationStatistics* statistics = nullptr) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  const Trajectory run = Simulate(system, x, Vector::Zero(system.num_inputs()), duration, options);
  EXPECT_TRUE(run.transitions.empty());
  ContactDynamics dynamics(system, Vector::Zero(system.num_inputs()));
  return PropagateArc(&dynamics, run.arcs.front(), tolerance, statistics);
}

TEST(Variation, OfAnOscillatorIsItsExactPropagator) {
  const auto system = test::Make<test::Oscillator>({{"centre", 10}});
  Vector x(2);
  x << 10, 1;
  for (double duration : {0.01, 1.0, 30.0}) {
    const Matrix phi = FreeFlight(system, x, duration, 1e-11);
    Matrix exact(2, 2);
    exact << std::cos(duration), std::sin(duration), -std::sin(duration), std::cos(duration);
    EXPECT_LE((phi - exact).cwiseAbs().maxCoeff(), 1e-9) << "t = " << duration;
  }
}

/// Servos damp the legs at rates up to 10³/s: what has decayed is not resolved again in every step,
/// and what is left keeps its tolerance. (The factor 10: local errors of some ten steps add up.)
TEST(Variation, ModesThatHaveDecayedCostLittle) {
  for (const char* robot : {"quadruped", "compliant_quadruped"}) {
    const auto system = LoadRobot(RobotFile(robot));
    const NominalRun& drop = system->nominal();
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    ContactDynamics dynamics(*system, drop.u);
    VariationStatistics half, whole;
    const Trajectory first = Simulate(*system, drop.x, drop.u, 0.05, options);
    PropagateArc(&dynamics, first.arcs.front(), 1e-9, &half);
    const Trajectory run = Simulate(*system, drop.x, drop.u, 0.1, options);
    ASSERT_TRUE(run.transitions.empty());
    const Matrix phi = PropagateArc(&dynamics, run.arcs.front(), 1e-9, &whole);
    const Matrix exact = PropagateArc(&dynamics, run.arcs.front(), 1e-13);
    EXPECT_LE((phi - exact).cwiseAbs().maxCoeff(), 1e-8 * exact.cwiseAbs().maxCoeff()) << robot;
    EXPECT_LT(whole.jacobians - half.jacobians, half.jacobians) << robot;
  }
}

/// In free flight soft_biped's springs stay at rest: the state is a polynomial, integrated exactly
/// with huge steps, while the tangents oscillate at 9 rad/s. The tangents' own error
/// control must notice.
TEST(Variation, TangentsAreResolvedWhereTheStateIsAPolynomial) {
  const test::ReferenceCase reference("soft_biped_tilted");
  VariationStatistics loose, tight;
  const Matrix phi = FreeFlight(*reference.system, reference.x, 0.9, 1e-9, &loose);
  const Matrix exact = FreeFlight(*reference.system, reference.x, 0.9, 1e-13, &tight);
  EXPECT_LE((phi - exact).cwiseAbs().maxCoeff(), 1e-8 * exact.cwiseAbs().maxCoeff());
  EXPECT_GT(tight.jacobians, loose.jacobians);
  // An independent answer: central differences of runs at 1e-13, error ~1e-8.
  constexpr double kStep = 1e-4;
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-13;
  for (int j = 0; j < 14; ++j) {
    Vector plus = reference.x, minus = reference.x;
    plus(j) += kStep;
    minus(j) -= kStep;
    const Vector column =
        (Simulate(*reference.system, plus, Vector(0), 0.9, options).FinalState() -
         Simulate(*reference.system, minus, Vector(0), 0.9, options).FinalState()) /
        (2 * kStep);
    EXPECT_LE((column - exact.col(j)).cwiseAbs().maxCoeff(), 1e-5) << "column " << j;
  }
}

TEST(Variation, TheToleranceIsKept) {
  const auto system = MakeModel("double_pendulum");
  const Vector x = system->nominal().x;
  const Matrix exact = FreeFlight(*system, x, 0.65, 1e-13);
  for (double tolerance : {1e-6, 1e-8, 1e-10}) {
    const double error = (FreeFlight(*system, x, 0.65, tolerance) - exact).cwiseAbs().maxCoeff();
    EXPECT_LE(error, 100 * tolerance * exact.cwiseAbs().maxCoeff()) << "tolerance " << tolerance;
  }
}

/// A foot that cannot slip stands on the curved ground between its stones: where these are changes
/// the split of its force, and its motion not at all. What rounding makes of that needs no steps.
TEST(Variation, PushesThatCancelAreNoSource) {
  const auto system = MakeModel("compass_walker");
  Vector x(8);
  x << -0.32678561285809793, 0.9798551199538409, 0.2099239836662834, -0.2589277327521208,
      1.0807381520869308, 0.2310215871711942, -1.103136616913782, -0.2899887602374082;
  const Trajectory run = Simulate(*system, x, Vector(0), 1.1);
  const Arc& stance = run.arcs.back();
  ASSERT_FALSE(stance.mode.Empty());
  ASSERT_EQ(system->description().parameters[7].name, "stone_left");
  ContactDynamics dynamics(*system, Vector(0), Variables{false, {7}});
  VariationStatistics statistics;
  const Matrix phi = PropagateArc(&dynamics, stance, 1e-9, &statistics);
  EXPECT_LE(phi.col(8).head(8).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LE(statistics.steps + statistics.rejected_steps, 10);
}

TEST(Variation, NeedsADenseRun) {
  const auto system = MakeModel("soft_biped");
  SimulateOptions options;
  options.dense = false;
  const Trajectory run = Simulate(*system, system->nominal().x, Vector(0), 0.5, options);
  EXPECT_THROW(DifferentiateOutcome(*system, run), std::logic_error);
}

TEST(Admissible, TangentVectorsKeepTheActiveConstraints) {
  const auto system = MakeModel("rigid_biped");
  Vector x = Vector::Zero(6);
  x(1) = 0.5;  // standing on both feet
  const ContactMode mode = InitialMode(*system, x, Vector(0));
  ASSERT_EQ(ContactMode({0, 1}), mode);
  const Vector w = ProjectAdmissible(*system, x, mode, Vector::Ones(6));
  // What remains is sliding: body_x and its rate.
  EXPECT_NEAR(1, w(0), 1e-12);
  EXPECT_NEAR(1, w(3), 1e-12);
  EXPECT_LE((w - Vector::Unit(6, 0) - Vector::Unit(6, 3)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Quotients, ShowAWrongDerivativeAsWrong) {
  const test::ReferenceCase reference("soft_biped_simultaneous");
  const Trajectory run = Simulate(*reference.system, reference.x, reference.u, reference.duration);
  const BDerivative B = DifferentiateOutcome(*reference.system, run);
  const Vector w = Vector::Unit(14, 4);
  const std::vector<double> alphas = {1e-3, 1e-4, 1e-5};
  const auto errors = [&](const Vector& prediction) {
    return CompareWithQuotients(*reference.system, reference.x, reference.u, reference.duration, w,
                                prediction, alphas);
  };
  EXPECT_NEAR(1, errors(B(w)).slope, 0.1);
  // The other side's derivative: the error stays at the size of the kink.
  const QuotientReport wrong = errors(-B(-w));
  EXPECT_NEAR(0, wrong.slope, 0.1);
  EXPECT_GT(wrong.samples.back().error, 0.1);
  EXPECT_THROW(CompareWithQuotients(*reference.system, reference.x, reference.u, 1, w, w, {-1e-3}),
               std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
