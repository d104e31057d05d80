// SPDX-License-Identifier: BSD-3-Clause
// The rolling derivative against the derivative of the whole run from the mark, however often it is
// looked at.
#include "contact_flow/derivative/rolling_derivative.h"

#include <gtest/gtest.h>

#include <random>

#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

using SystemPointer = std::shared_ptr<const MechanicalSystem>;

/// Lets the run go to `end` in strides of up to `stride`, the derivative following.
void Roll(OnlineFlow* run, RollingDerivative* rolling, double end, double stride,
          std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(0.1, 1);
  while (run->now() < end && run->status().ok()) {
    const double target = std::min(end, run->now() + stride * uniform(*random));
    bool passed = true;
    while (passed) {
      passed = run->AdvanceTo(target);
      rolling->Follow(run, passed);
    }
  }
}

/// Some directions, both signs, that the state at the mark admits.
Matrix Admissible(const MechanicalSystem& system, const Vector& x, ContactMode mode, int extra,
                  std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int size = 2 * system.dof() + extra;
  Matrix directions(size, 4);
  for (int j = 0; j < 4; j += 2) {
    Vector w(size);
    for (double& value : w) value = uniform(*random);
    w.head(2 * system.dof()) = ProjectAdmissible(system, x, mode, w.head(2 * system.dof()));
    directions.col(j) = w;
    directions.col(j + 1) = -w;
  }
  return directions;
}

void ExpectClose(const BDerivative& whole, const Matrix& directions,
                 const RollingDerivative::Reading& rolling, double tolerance,
                 const std::string& where) {
  ASSERT_TRUE(whole.status.ok()) << where << whole.status.message;
  ASSERT_TRUE(rolling.status.ok()) << where << rolling.status.message;
  for (int j = 0; j < directions.cols(); ++j) {
    const Vector expected = whole(directions.col(j));
    const double error = (rolling.tangents.col(j) - expected).cwiseAbs().maxCoeff();
    EXPECT_LT(error, tolerance * (1 + expected.cwiseAbs().maxCoeff())) << where << ", " << j;
  }
}

/// Motion, mark and end of each case; the tolerance allows each slice the integrator's, 1e-9,
/// amplified by what follows.
TEST(RollingDerivative, IsTheDerivativeOfTheWholeRun) {
  const struct {
    const char* model;
    double mark, end;  // parts of the nominal duration
  } cases[] = {{"soft_biped", 0.2, 1},       {"hopping_trot", 0.1, 1.3},
               {"double_pendulum", 0, 1},    {"ball_in_corner", 0.3, 1.2},
               {"falling_box", 0.5, 1},      {"legged_table", 0.1, 1},
               {"wall_and_floor", 0, 1},     {"jointed_biped", 0.2, 0.6},
               {"block_on_incline", 0.2, 1}, {"puck", 0.1, 1},
               {"spinning_ball", 0, 1},      {"compass_walker", 0.3, 1},
               {"rimless_wheel", 0.1, 1},    {"sliding_rod", 0.1, 1}};
  std::mt19937 random(5);
  for (const auto& test : cases) {
    for (double stride : {0.003, 0.05, 10.0}) {
      const SystemPointer system = MakeModel(test.model);
      const NominalRun& nominal = system->nominal();
      const double mark = test.mark * nominal.duration, end = test.end * nominal.duration;
      OnlineFlow run(system, 0, nominal.x, nominal.u, {});
      while (run.AdvanceTo(mark)) continue;
      const Vector x = run.State();
      const BDerivativeOptions options;
      RollingDerivative rolling(&run, Admissible(*system, x, run.mode(), 0, &random), options, {});
      Roll(&run, &rolling, end, stride, &random);
      const Trajectory whole = Simulate(*system, x, nominal.u, end - mark);
      const BDerivative expected = DifferentiateOutcome(*system, whole, options);
      const RollingDerivative::Reading reading = rolling.Read(&run);
      ExpectClose(expected, rolling.directions(), reading, 1e-6, test.model);
      EXPECT_EQ(reading.t, end);
      const Vector& time = expected.time;
      EXPECT_LT((reading.time - time).cwiseAbs().maxCoeff(),
                1e-5 * (1 + time.cwiseAbs().maxCoeff()));
    }
  }
}

TEST(RollingDerivative, CarriesInputsAndParametersThroughChangesOfTheInput) {
  const SystemPointer system = MakeModel("falling_box");
  const NominalRun& nominal = system->nominal();
  std::mt19937 random(9);
  BDerivativeOptions options;
  options.variables = {true, ParameterIndices(system->description(), {"mass"})};
  OnlineFlow run(system, 0, nominal.x, nominal.u, {});
  const int k = options.variables.Size(*system);
  RollingDerivative rolling(&run, Admissible(*system, nominal.x, run.mode(), k, &random), options,
                            {});
  InputSchedule inputs{{0}, {nominal.u}};
  for (int i = 1; i < 4; ++i) {
    inputs.grid.push_back(0.23 * i * nominal.duration);
    inputs.values.push_back(nominal.u + 0.1 * Vector::Random(nominal.u.size()));
    run.SetInput(inputs.grid.back(), inputs.values.back());
  }
  Roll(&run, &rolling, nominal.duration, 0.01, &random);
  const Trajectory whole = Simulate(*system, nominal.x, inputs, nominal.duration);
  ASSERT_GT(whole.transitions.size(), 4u) << "impacts and inputs";
  ExpectClose(DifferentiateOutcome(*system, whole, options), rolling.directions(),
              rolling.Read(&run), 1e-6, "falling_box");
}

/// Readings at common instants, of runs that are looked at now and then, often, and
/// read at every look.
TEST(RollingDerivative, IsTheSameToTheBitHoweverItIsLookedAt) {
  const double parts[] = {0.31, 0.314, 0.55, 0.8, 1.1};
  for (const char* model : {"soft_biped", "hopping_trot", "falling_box", "legged_table"}) {
    const SystemPointer system = MakeModel(model);
    const NominalRun& nominal = system->nominal();
    const auto readings = [&](double stride, bool read, unsigned seed) {
      std::mt19937 random(seed), same(7);
      OnlineFlow run(system, 0, nominal.x, nominal.u, {});
      if (nominal.u.size() > 0) run.SetInput(0.4 * nominal.duration, 1.1 * nominal.u);
      while (run.AdvanceTo(0.2 * nominal.duration)) continue;
      const Matrix directions = Admissible(*system, run.State(), run.mode(), 0, &same);
      RollingDerivative rolling(&run, directions, {}, {});
      std::vector<RollingDerivative::Reading> found;
      for (double part : parts) {
        const double end = part * nominal.duration;
        while (run.now() < end) {
          Roll(&run, &rolling, std::min(end, run.now() + stride), stride, &random);
          if (read) rolling.Read(&run);
        }
        found.push_back(rolling.Read(&run));
      }
      return found;
    };
    const auto seldom = readings(10, false, 1);
    for (const auto& often : {readings(0.0017, false, 2), readings(0.0031, true, 3)}) {
      for (std::size_t i = 0; i < seldom.size(); ++i) {
        ASSERT_TRUE(seldom[i].status.ok()) << model << seldom[i].status.message;
        EXPECT_EQ(often[i].t, seldom[i].t) << model;
        EXPECT_TRUE(often[i].tangents == seldom[i].tangents) << model << " at " << seldom[i].t;
        EXPECT_TRUE(often[i].time == seldom[i].time) << model << " at " << seldom[i].t;
      }
    }
  }
}

TEST(RollingDerivative, IsTheDifferenceQuotientOfARobot) {
  const SystemPointer system = LoadRobot(RobotFile("monoped"));
  const NominalRun& nominal = system->nominal();
  OnlineFlow run(system, 0, nominal.x, nominal.u, {});
  std::mt19937 random(2);
  RollingDerivative rolling(&run, Admissible(*system, nominal.x, run.mode(), 0, &random), {}, {});
  Roll(&run, &rolling, nominal.duration, 0.02, &random);
  const RollingDerivative::Reading reading = rolling.Read(&run);
  ASSERT_TRUE(reading.status.ok()) << reading.status.message;
  for (int j = 0; j < 4; ++j) {
    const QuotientReport report =
        CompareWithQuotients(*system, nominal.x, nominal.u, nominal.duration,
                             rolling.directions().col(j), reading.tangents.col(j), {1e-5}, {});
    ASSERT_TRUE(report.samples[0].status.ok()) << report.samples[0].status.message;
    EXPECT_LT(report.samples[0].error, 1e-2) << "O(α), with constants of about 100";
  }
}

TEST(RollingDerivative, EndsWhereThereIsNone) {
  const SystemPointer system = MakeModel("rigid_biped");
  const NominalRun& nominal = system->nominal();
  OnlineFlow run(system, 0, nominal.x, nominal.u, {});
  RollingDerivative rolling(&run, Matrix::Identity(2 * system->dof(), 1), {}, {});
  std::mt19937 random(2);
  Roll(&run, &rolling, nominal.duration, 0.1, &random);
  EXPECT_TRUE(run.status().ok()) << "the run goes on";
  EXPECT_EQ(rolling.status().outcome, Outcome::kDiscontinuous);
  EXPECT_LT(rolling.Read(&run).t, run.now());
}

TEST(RollingDerivative, RefusesDirections) {
  const SystemPointer system = MakeModel("soft_biped");
  OnlineFlow run(system, 0, system->nominal().x, system->nominal().u, {});
  EXPECT_THROW(RollingDerivative(&run, Matrix::Zero(3, 1), {}, {}), std::invalid_argument);
  EXPECT_THROW(RollingDerivative(&run, Matrix::Zero(14, 0), {}, {}), std::invalid_argument);
  EXPECT_THROW(RollingDerivative(&run, Matrix::Constant(14, 1, NAN), {}, {}),
               std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
