// SPDX-License-Identifier: BSD-3-Clause
// The outcome as a map of inputs on a grid, beside re-simulated runs; and whether it
// is controllable.
#include "contact_flow/analysis/input_map.h"

#include <gtest/gtest.h>

#include <random>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/controllability.h"
#include "test/analysis/random_conewise.h"

namespace contact_flow {
namespace {

/// The run of the double pendulum that reaches both stops at once, under torques on a grid.
class PendulumInputs : public testing::Test {
 protected:
  Trajectory Go(const Vector& change, double simultaneity) const {
    InputSchedule schedule;
    schedule.grid = {0, 0.2, 0.5};
    for (int k = 0; k < 3; ++k) schedule.values.push_back(change.segment(2 * k, 2));
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    options.simultaneity_tolerance = simultaneity;
    return Simulate(*system, system->nominal().x, schedule, system->nominal().duration, options);
  }
  const std::unique_ptr<MechanicalSystem> system = MakeModel("double_pendulum");
};

TEST_F(PendulumInputs, AgreesWithQuotients) {
  const Trajectory run = Go(Vector::Zero(6), 1e-7);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const PiecewiseLinearMap map = InputMap(Linearize(*system, run));
  ASSERT_EQ(4, map.rows());
  ASSERT_EQ(6, map.cols());
  EXPECT_EQ(2u, map.pieces().size()) << "either stop first";
  std::mt19937 generator(1);
  for (int trial = 0; trial < 10; ++trial) {
    const Vector d = test::RandomMatrix(6, 1, &generator).normalized();
    for (double alpha : {1e-3, 1e-4, 1e-5}) {
      const Trajectory moved = Go(alpha * d, 1e-4 * alpha);
      ASSERT_TRUE(moved.status.ok());
      const Vector quotient = (moved.FinalState() - run.FinalState()) / alpha;
      EXPECT_LE((quotient - map(d)).cwiseAbs().maxCoeff(), 500 * alpha + 1e-10 / alpha) << alpha;
    }
  }
}

TEST_F(PendulumInputs, AreControllable) {
  // Elastic stops lose no dimension: six torques reach all four.
  const PiecewiseLinearMap map = InputMap(Linearize(*system, Go(Vector::Zero(6), 1e-7)));
  const ControllabilityReport report = AssessControllability(map);
  EXPECT_EQ(ControllabilityVerdict::kControllable, report.verdict) << report.message;
  EXPECT_EQ(4, report.reachable.cols());
  EXPECT_EQ(2, report.pieces);
}

TEST(InputMap, RefusesWhatHasNone) {
  const auto biped = MakeModel("soft_biped");
  const NominalRun& nominal = biped->nominal();
  EXPECT_THROW(InputMap(Linearize(*biped, Simulate(*biped, nominal.x, nominal.u, 0.5))),
               std::invalid_argument);
  EXPECT_THROW(InputMap({}), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
