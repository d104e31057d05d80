// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/simulate_batch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

constexpr LaneSet kSets[] = {LaneSet::kNone, LaneSet::kAvx2, LaneSet::kAvx512};

bool SameBits(const Vector& a, const Vector& b) {
  const auto bytes = sizeof(double) * static_cast<std::size_t>(a.size());
  return a.size() == b.size() && (bytes == 0 || std::memcmp(a.data(), b.data(), bytes) == 0);
}

/// Holds a run of a batch to that of Simulate from the same start, to the bit.
void ExpectSameRun(const BatchRun& run, const MechanicalSystem& system, const Vector& x,
                   const Vector& u, double duration, SimulateOptions options) {
  options.dense = false;
  Trajectory single;
  try {
    single = Simulate(system, x, u, duration, options);
  } catch (const std::invalid_argument& reason) {
    EXPECT_EQ(run.refused, reason.what());
    return;
  }
  EXPECT_EQ(run.refused, "");
  EXPECT_EQ(run.status.outcome, single.status.outcome);
  EXPECT_EQ(run.status.message, single.status.message);
  EXPECT_EQ(run.t_end, single.t_end());
  EXPECT_TRUE(SameBits(run.final_state, single.FinalState()));
  EXPECT_TRUE(SameBits(run.error, single.arcs.back().error));
  EXPECT_EQ(run.first_mode, single.arcs.front().mode);
  ASSERT_EQ(run.events.size(), single.transitions.size());
  for (std::size_t k = 0; k < run.events.size(); ++k) {
    const Transition& passed = single.transitions[k];
    EXPECT_EQ(run.events[k].t, passed.t);
    EXPECT_EQ(run.events[k].activated, passed.activated);
    EXPECT_EQ(run.events[k].released, passed.released);
    EXPECT_EQ(run.events[k].mode_after, passed.mode_after);
    EXPECT_TRUE(SameBits(run.events[k].impulse, passed.impulse));
  }
  EXPECT_EQ(run.margins.approach_speed, single.margins.approach_speed);
  EXPECT_EQ(run.margins.release_rate, single.margins.release_rate);
  EXPECT_EQ(run.margins.gap, single.margins.gap);
  EXPECT_EQ(run.margins.force, single.margins.force);
  EXPECT_EQ(run.margins.event_interval, single.margins.event_interval);
  EXPECT_EQ(run.margins.cluster_spread, single.margins.cluster_spread);
  EXPECT_EQ(run.statistics.field_evaluations, single.statistics.field_evaluations);
  EXPECT_EQ(run.statistics.steps, single.statistics.steps);
  EXPECT_EQ(run.statistics.rejected_steps, single.statistics.rejected_steps);
  EXPECT_EQ(run.num_warnings, single.num_warnings);
}

/// Starts around the nominal one.
Matrix Starts(const MechanicalSystem& system, int count, double spread, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal(0, spread);
  Matrix states(system.state_size(), count);
  for (int k = 0; k < count; ++k) {
    states.col(k) = system.nominal().x;
    for (double& number : states.col(k)) number += normal(generator);
  }
  return states;
}

/// All starts by all sets of lanes; returns how many runs of the widest were made in lanes.
long ExpectSameAll(const MechanicalSystem& system, const Matrix& states, const Matrix& inputs,
                   double duration, const SimulateOptions& options = {}) {
  long in_lanes = 0;
  for (LaneSet set : kSets) {
    BatchOptions batch;
    batch.lanes = set;
    const BatchResult result = SimulateBatch(system, states, inputs, duration, options, batch);
    EXPECT_EQ(result.runs.size(), static_cast<std::size_t>(states.cols()));
    EXPECT_EQ(result.why.empty(), result.width > 1);
    for (Eigen::Index k = 0; k < states.cols(); ++k) {
      SCOPED_TRACE("run " + std::to_string(k) + " of set " + std::to_string(static_cast<int>(set)));
      ExpectSameRun(result.runs[static_cast<std::size_t>(k)], system, states.col(k),
                    inputs.col(inputs.cols() == 1 ? 0 : k), duration, options);
      if (testing::Test::HasFailure()) return 0;
    }
    if (result.width > 1) in_lanes = states.cols() - result.alone;
  }
  return in_lanes;
}

bool MachineHasLanes() {
  const auto system = MakeModel("soft_biped", {});
  return SimulateBatch(*system, system->nominal().x, Vector(), 0.1).width > 1;
}

TEST(SimulateBatch, GivesTheBitsOfSingleRuns) {
  const std::vector<std::pair<std::string, double>> models = {
      {"soft_biped", 1.4}, {"hopping_trot", 0.8}, {"driven_ball", 1.5}, {"wall_and_floor", 1}};
  for (const auto& [name, duration] : models) {
    SCOPED_TRACE(name);
    const auto system = MakeModel(name, {});
    const Matrix states = Starts(*system, 43, 0.005, 1);
    const Matrix inputs = Vector::Zero(system->num_inputs());
    const long in_lanes = ExpectSameAll(*system, states, inputs, duration);
    if (MachineHasLanes() && name != "wall_and_floor") EXPECT_GT(in_lanes, 20);
  }
}

TEST(SimulateBatch, GivesThemAtOtherTolerancesAndMethods) {
  const auto system = MakeModel("soft_biped", {});
  const Matrix states = Starts(*system, 21, 0.1, 2);
  for (double tolerance : {1e-4, 1e-11}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    options.method = IntegrationMethod::kExplicit;
    options.max_step = tolerance > 1e-5 ? 0.05 : 0;
    const long in_lanes = ExpectSameAll(*system, states, Vector(), 3, options);
    if (MachineHasLanes()) EXPECT_GT(in_lanes, 10);
  }
}

/// Steps so short that most are clear, with a floor that feet take more than one to leave.
TEST(SimulateBatch, GivesThemWhereFeetLeaveTheirFloorsSlowly) {
  const auto system = MakeModel("soft_biped", {{"body_inertia", 0.8853210184713968}});
  const Matrix states = Starts(*system, 21, 1e-6, 5);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-3;
  options.max_step = 0.01;
  ExpectSameAll(*system, states, Vector(), 2.2, options);
  options.simultaneity_tolerance = 0.01;
  const long in_lanes = ExpectSameAll(*system, states, Vector(), 2.2, options);
  if (MachineHasLanes()) EXPECT_GT(in_lanes, 10);
}

TEST(SimulateBatch, HasInputsOfEachRun) {
  const auto system = MakeModel("steered_trot", {});
  const Matrix states = Starts(*system, 9, 0.002, 3);
  Matrix inputs(1, 9);
  for (int k = 0; k < 9; ++k) inputs(0, k) = 0.01 * (k - 4);
  const long in_lanes = ExpectSameAll(*system, states, inputs, 0.8);
  if (MachineHasLanes()) EXPECT_GT(in_lanes, 4);
}

TEST(SimulateBatch, StartsOnContacts) {
  const auto system = MakeModel("soft_biped", {});
  Matrix states = Starts(*system, 12, 0.01, 4);
  for (int k = 0; k < 12; ++k) {
    for (int foot = 0; foot < 2; ++foot) {
      if (foot == 1 && k % 2 == 0) continue;
      states(4 + foot, k) = 0;  // stands
      states(11 + foot, k) = 0;
    }
    states(3, k) = 0.45;
  }
  const long in_lanes = ExpectSameAll(*system, states, Vector(), 1.5);
  if (MachineHasLanes()) EXPECT_GT(in_lanes, 0);
}

TEST(SimulateBatch, KeepsTheFailuresOfARunToItself) {
  const auto system = MakeModel("soft_biped", {});
  Matrix states = Starts(*system, 11, 0.01, 5);
  states(2, 1) = std::numeric_limits<double>::quiet_NaN();
  states(4, 3) = -0.1;  // penetrates
  states(10, 5) = 1e200;
  states(13, 7) = 1e12;  // spins
  SimulateOptions options;
  options.max_steps = 300;
  const long in_lanes = ExpectSameAll(*system, states, Vector(), 1.4, options);
  if (MachineHasLanes()) EXPECT_GE(in_lanes, 7);
  options.max_steps = 22;  // enough for some
  ExpectSameAll(*system, states, Vector(), 1.4, options);
  options.max_steps = 1000;
  options.max_events = 1;
  ExpectSameAll(*system, states, Vector(), 1.4, options);
}

TEST(SimulateBatch, LeavesZenoAndStiffnessToSingleRuns) {
  const auto ball = MakeModel("driven_ball", {{"restitution", 0.5}});
  const Matrix states = Starts(*ball, 7, 0.1, 6);
  const BatchResult zeno = SimulateBatch(*ball, states, Vector::Zero(1), 10);
  EXPECT_EQ(zeno.alone, 7);
  EXPECT_EQ(zeno.runs.front().status.outcome, Outcome::kZeno);
  EXPECT_TRUE(std::isfinite(zeno.runs.front().accumulation_time));
  ExpectSameAll(*ball, states, Vector::Zero(1), 10);

  const auto stiff = MakeModel("soft_biped", {{"stiffness", 1e7}, {"flywheel", 0}});
  SimulateOptions loose;
  loose.relative_tolerance = loose.absolute_tolerance = 1e-3;
  ExpectSameAll(*stiff, Starts(*stiff, 5, 1e-4, 7), Vector(), 0.3, loose);
}

TEST(SimulateBatch, SaysWhyThereAreNoLanes) {
  const auto system = MakeModel("rigid_biped", {});
  const Matrix states = system->nominal().x.replicate(1, 3);
  const BatchResult result = SimulateBatch(*system, states, system->nominal().u, 0.2);
  EXPECT_EQ(result.width, 1);
  EXPECT_EQ(result.alone, 3);
  EXPECT_NE(result.why.find("rigid_biped"), std::string::npos) << result.why;
  ExpectSameAll(*system, states, system->nominal().u, 0.2);
  const auto biped = MakeModel("soft_biped", {});
  SimulateOptions implicit;
  implicit.method = IntegrationMethod::kImplicit;
  const BatchResult alone = SimulateBatch(*biped, biped->nominal().x, Vector(), 0.2, implicit);
  EXPECT_NE(alone.why.find("implicit"), std::string::npos) << alone.why;
}

TEST(SimulateBatch, DependsOnNoOrderNorThreads) {
  const auto system = MakeModel("hopping_trot", {});
  const Matrix states = Starts(*system, 37, 0.005, 8);
  const BatchResult forward = SimulateBatch(*system, states, Vector(), 0.8);
  BatchOptions threads;
  threads.threads = 3;
  const BatchResult backward =
      SimulateBatch(*system, states.rowwise().reverse(), Vector(), 0.8, {}, threads);
  for (std::size_t k = 0; k < 37; ++k) {
    EXPECT_TRUE(SameBits(forward.runs[k].final_state, backward.runs[36 - k].final_state)) << k;
  }
}

TEST(SimulateBatch, RefusesWhatDoesNotFit) {
  const auto system = MakeModel("soft_biped", {});
  const Matrix states = system->nominal().x.replicate(1, 2);
  const BatchResult none = SimulateBatch(*system, Matrix(14, 0), Vector(), 1);
  EXPECT_TRUE(none.runs.empty());
  const auto refuses = [&](const Matrix& x, const Matrix& u, double duration, int threads,
                           const char* word) {
    BatchOptions batch;
    batch.threads = threads;
    try {
      SimulateBatch(*system, x, u, duration, {}, batch);
      ADD_FAILURE() << word;
    } catch (const std::invalid_argument& reason) {
      EXPECT_NE(std::string(reason.what()).find(word), std::string::npos) << reason.what();
    }
  };
  refuses(states.topRows(13), Vector(), 1, 1, "states has 13 rows");
  refuses(states, Vector::Zero(1), 1, 1, "inputs has 1 rows");
  refuses(states, Matrix(0, 3), 1, 1, "inputs has 3 columns");
  refuses(states, Vector(), -1, 1, "duration is -1");
  refuses(states, Vector(), 1, 0, "threads is 0");
}

TEST(SimulateBatch, IsCancelled) {
  const auto system = MakeModel("soft_biped", {});
  const Matrix states = Starts(*system, 10, 0.01, 9);
  SimulateOptions options;
  int asked = 0;
  options.cancelled = [&] { return ++asked > 20; };
  const BatchResult result = SimulateBatch(*system, states, Vector(), 1.4, options);
  EXPECT_EQ(result.runs.back().status.outcome, Outcome::kCancelled);
}

}  // namespace
}  // namespace contact_flow
