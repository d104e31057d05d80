// SPDX-License-Identifier: BSD-3-Clause
// An online run is one call of Simulate, to the bit, whatever the instants at which
// it is looked at.
#include "contact_flow/flow/online_flow.h"

#include <gtest/gtest.h>

#include <random>

#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

using SystemPointer = std::shared_ptr<const MechanicalSystem>;

/// A run with what was seen of it.
struct Seen {
  std::vector<Transition> transitions;
  std::vector<std::pair<double, Vector>> states;
  InputSchedule inputs;
  Status status;
};

/// Goes to `end` in strides drawn from (0, stride], and on the way, each with this probability,
/// looks at the state, changes the input, tells one for later, or pauses where it is.
Seen RunOnline(OnlineFlow* run, double end, double stride, double probability,
               std::mt19937* random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto chance = [&] { return uniform(*random) < probability; };
  Seen seen;
  seen.inputs = {{run->now()}, {run->u()}};
  const auto change = [&](double t) {
    Vector u = run->u();
    for (double& value : u) value += 0.2 * (uniform(*random) - 0.5);
    run->SetInput(t, u);
    while (seen.inputs.grid.back() >= t && seen.inputs.grid.size() > 1) {  // told anew
      seen.inputs.grid.pop_back();
      seen.inputs.values.pop_back();
    }
    if (seen.inputs.grid.back() == t) {
      seen.inputs.values.back() = u;
    } else {
      seen.inputs.grid.push_back(t);
      seen.inputs.values.push_back(u);
    }
  };
  double target = run->now();
  while (run->now() < end && run->status().ok()) {
    if (run->now() >= target) target = std::min(end, target + stride * (1 - uniform(*random)));
    if (run->AdvanceTo(target)) {
      seen.transitions.push_back(run->transition());
      // Told at the very instant of an event, after it.
      if (chance() && run->now() > seen.inputs.grid.back()) change(run->now());
      continue;
    }
    if (run->now() < target) break;
    if (chance()) seen.states.emplace_back(run->now(), run->State());
    if (run->now() <= seen.inputs.grid.back()) continue;
    if (chance()) change(run->now());
    if (chance() && chance()) change(run->now() + 3 * stride * uniform(*random));
    if (chance()) {
      EXPECT_FALSE(run->AdvanceTo(run->now())) << "a pause";
    }
  }
  seen.status = run->status();
  return seen;
}

void ExpectSeen(const SystemPointer& system, const Vector& x, const Seen& seen, double end,
                const SimulateOptions& options, const std::string& where) {
  const double begin = seen.inputs.grid.front();
  const Trajectory run = Simulate(*system, x, seen.inputs, 1.5 * (end - begin) + 1, options);
  std::size_t events = 0;
  for (const Transition& transition : run.transitions) events += transition.t <= end;
  // At `end` itself an input may have been told that nobody waited for.
  if (!run.transitions.empty() && events > 0 && events == seen.transitions.size() + 1) {
    ASSERT_EQ(run.transitions[events - 1].t, end) << where;
    --events;
  }
  ASSERT_EQ(events, seen.transitions.size())
      << where << ": " << run.status.message << " / " << seen.status.message;
  for (std::size_t k = 0; k < events; ++k) {
    const Transition &a = run.transitions[k], &b = seen.transitions[k];
    ASSERT_EQ(a.t, b.t) << where << ", event " << k;
    ASSERT_EQ(a.x_minus, b.x_minus) << where << ", event " << k;
    ASSERT_EQ(a.x_plus, b.x_plus) << where << ", event " << k;
    ASSERT_EQ(a.impulse, b.impulse) << where;
    ASSERT_EQ(a.mode_after, b.mode_after) << where;
    ASSERT_EQ(a.changes_input, b.changes_input) << where;
  }
  for (const auto& [t, state] : seen.states) {
    if (t > run.t_end()) continue;
    bool at_event =
        false;  // there the trajectory is continuous from the left, the online state from the right
    for (const Transition& transition : run.transitions) at_event |= transition.t == t;
    if (at_event) continue;
    ASSERT_EQ(run.State(t), state) << where << ", t = " << t;
  }
}

class OnlineModels : public ::testing::TestWithParam<std::string> {};

TEST_P(OnlineModels, IsOneSimulation) {
  const SystemPointer system = MakeModel(GetParam());
  std::mt19937 random(7);
  const NominalRun& nominal = system->nominal();
  SimulateOptions options;
  options.complete_zeno = true;
  int events = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const double end = 1.5 * nominal.duration, stride = end * std::pow(10.0, -trial / 4.0 - 0.3);
    OnlineFlow run(system, trial % 3 == 0 ? 0 : 1000.1 * trial, nominal.x, nominal.u, options);
    const double from = run.now();
    const Seen seen = RunOnline(&run, from + end, stride, trial == 0 ? 0 : 0.2, &random);
    ExpectSeen(system, nominal.x, seen, run.now(), options,
               GetParam() + ", trial " + std::to_string(trial));
    events += static_cast<int>(seen.transitions.size());
  }
  EXPECT_GT(events, 10);
}

INSTANTIATE_TEST_SUITE_P(All, OnlineModels, ::testing::ValuesIn(ModelNames()),
                         [](const auto& info) { return info.param; });

TEST(OnlineFlow, IsOneSimulationOfRobots) {
  for (const char* name : {"monoped", "compliant_quadruped"}) {
    const SystemPointer system =
        LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/../../config/robots/" + name + ".yaml");
    std::mt19937 random(3);
    const NominalRun& nominal = system->nominal();
    const double end = 1.2 * nominal.duration;
    OnlineFlow run(system, 0, nominal.x, nominal.u, {});
    const Seen seen = RunOnline(&run, end, 0.03, 0.2, &random);
    EXPECT_GT(seen.inputs.grid.size(), 2u) << "inputs were told";
    ExpectSeen(system, nominal.x, seen, run.now(), {}, name);
  }
}

/// What Simulate promises of its schedule, which the above rests on.
TEST(OnlineFlow, MotionDoesNotDependOnLaterInputs) {
  const auto system = MakeModel("falling_box");
  const NominalRun& nominal = system->nominal();
  const Trajectory plain = Simulate(*system, nominal.x, nominal.u, 10 * nominal.duration);
  ASSERT_GE(plain.transitions.size(), 2u);
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    // Just behind an event, where a step that was cut would have found other bits, or none.
    const double event = plain.transitions[trial % 2].t;
    const double t = event + std::pow(10.0, -14 + 0.25 * trial);
    const Vector u = nominal.u + Vector::Ones(nominal.u.size());
    const Trajectory run =
        Simulate(*system, nominal.x, {{0, t}, {nominal.u, u}}, 10 * nominal.duration);
    EXPECT_EQ(run.transitions[trial % 2].t, event);
    EXPECT_EQ(run.transitions[trial % 2].x_plus, plain.transitions[trial % 2].x_plus);
  }
}

TEST(OnlineFlow, SettledStateIsTheEndOfAnArcThatAnInputEnds) {
  const SystemPointer system = MakeModel("soft_biped");
  const NominalRun& nominal = system->nominal();
  for (double t : {0.3, 0.9999, 1.05, 1.2}) {
    OnlineFlow run(system, 0, nominal.x, nominal.u, {});
    while (run.AdvanceTo(t)) continue;
    const Vector interpolated = run.State();
    run.Settle();
    const Trajectory reference =
        Simulate(*system, nominal.x, {{0, t}, {nominal.u, nominal.u}}, t + 5);
    EXPECT_EQ(run.State(), reference.transitions[t > 1 ? 1 : 0].x_minus);
    EXPECT_LT((run.State() - interpolated).cwiseAbs().maxCoeff(), 1e-7) << "interpolation";
  }
}

TEST(OnlineFlow, RefusesThePast) {
  const SystemPointer system = MakeModel("falling_box");
  OnlineFlow run(system, 0, system->nominal().x, system->nominal().u, {});
  run.AdvanceTo(0.1);
  EXPECT_THROW(run.AdvanceTo(0.05), std::invalid_argument);
  EXPECT_THROW(run.AdvanceTo(std::nan("")), std::invalid_argument);
  EXPECT_THROW(run.SetInput(0.05, system->nominal().u), std::invalid_argument);
  EXPECT_THROW(run.SetInput(0.2, Vector::Zero(1)), std::invalid_argument);
  Vector u = system->nominal().u;
  u(0) = std::nan("");
  EXPECT_THROW(run.SetInput(0.2, u), std::invalid_argument);
}

TEST(OnlineFlow, StopsWithAReason) {
  const SystemPointer ball = MakeModel("bouncing_ball");
  OnlineFlow run(ball, 0, ball->nominal().x, ball->nominal().u, {});
  while (run.AdvanceTo(100)) continue;
  EXPECT_EQ(run.status().outcome, Outcome::kZeno);
  EXPECT_LT(run.now(), 100);
  EXPECT_FALSE(run.AdvanceTo(200));
}

TEST(OnlineFlow, MotionIsKeptFromTheLastForget) {
  const SystemPointer system = MakeModel("hopping_trot");
  const NominalRun& nominal = system->nominal();
  OnlineFlow run(system, 0, nominal.x, nominal.u, {});
  const Trajectory reference = Simulate(*system, nominal.x, nominal.u, 1.5 * nominal.duration);
  run.KeepMotion(true);
  double last = 0;
  std::size_t most = 0;
  for (int k = 1; k <= 1000; ++k) {
    const double t = nominal.duration * k / 1000;
    bool passed = true;
    while (passed) {
      passed = run.AdvanceTo(t);
      const Arc motion = run.Motion();
      most = std::max(most, motion.dense.NumSteps());
      ASSERT_EQ(motion.t_end, run.now());
      const double middle = 0.5 * (last + motion.t_end);
      Vector x(system->state_size());
      motion.dense.Evaluate(middle, x.data());
      ASSERT_EQ(x, reference.State(middle)) << middle;
      last = motion.t_end;
      run.Forget();
    }
  }
  EXPECT_LE(most, 2u);
}

}  // namespace
}  // namespace contact_flow
