// SPDX-License-Identifier: BSD-3-Clause
// A session from the start to its end, as any front end may drive it.
#include "src/session/session.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "test/session/same_bits.h"

namespace contact_flow {
namespace {

/// What a session has told.
struct Record {
  std::vector<EpochBegin> epochs;
  std::vector<ToldInput> inputs;
  std::vector<AskedMark> marks;
  std::vector<AskedPrediction> asked;
  std::vector<Prediction> predicted;

  Session::Log Log() {
    Session::Log log;
    log.epoch = [this](const EpochBegin& begin) { epochs.push_back(begin); };
    log.input = [this](const ToldInput& input) { inputs.push_back(input); };
    log.mark = [this](const AskedMark& mark) { marks.push_back(mark); };
    log.asked = [this](const AskedPrediction& prediction) { asked.push_back(prediction); };
    log.predicted = [this](const Prediction& prediction) { predicted.push_back(prediction); };
    return log;
  }
};

Configuration Of(const std::string& model) {
  Configuration configuration;
  configuration.model = model;
  return configuration;
}

/// Goes on to t, as a front end does, and returns how many events were passed.
int Go(Session* session, double t) {
  int events = 0;
  while (session->now() < t && session->status().ok()) events += session->AdvanceTo(t);
  return events;
}

template <class Command>
std::string Refusal(const Command& command) {
  try {
    command();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Session, BeginsWithTheNominalRun) {
  Record record;
  Session session(Of("driven_ball"), {}, record.Log());
  const NominalRun& nominal = session.setup()->system->nominal();
  ASSERT_EQ(1u, record.epochs.size());
  const EpochBegin& begin = record.epochs[0];
  EXPECT_EQ(1u, begin.epoch);
  EXPECT_EQ("start", begin.cause);
  EXPECT_EQ(0, begin.t);
  EXPECT_TRUE(SameBits(nominal.x.head(1), begin.q));
  EXPECT_TRUE(SameBits(nominal.x.tail(1), begin.v));
  EXPECT_TRUE(SameBits(nominal.u, begin.u));
  EXPECT_EQ("mass", begin.parameters.front().name);
  EXPECT_EQ(0, begin.q_before.size());
  EXPECT_EQ(0, begin.impulse.size());
  EXPECT_EQ(1u, session.epoch());
  EXPECT_EQ(0u, session.events());
  EXPECT_TRUE(session.TakeParametersChanged());
  EXPECT_FALSE(session.TakeParametersChanged());
  EXPECT_TRUE(session.status().ok());
}

/// Steps of any length lead through the states and events of one run: the same numbers.
TEST(Session, StepsAreThoseOfOneRun) {
  const Configuration configuration;  // soft_biped
  Session session(configuration, {}, {});
  const MechanicalSystem& system = *session.setup()->system;
  SimulateOptions options = session.setup()->options;
  options.dense = true;
  const NominalRun& nominal = system.nominal();
  const Trajectory run = Simulate(system, nominal.x, nominal.u, 3, options);
  ASSERT_GE(run.transitions.size(), 1u);
  std::size_t passed = 0;
  for (int k = 1; k <= 140; ++k) {
    const double t = 0.01 * k;
    while (session.now() < t) {
      if (!session.AdvanceTo(t)) continue;
      ASSERT_LT(passed, run.transitions.size());
      const Transition& expected = run.transitions[passed++];
      EXPECT_EQ(expected.t, session.transition().t);
      EXPECT_EQ(expected.x_plus, session.transition().x_plus);
    }
    const Instant now = session.Now();
    EXPECT_EQ(t, now.t);
    ASSERT_EQ(run.State(t), now.x) << t;
    EXPECT_EQ(run.arcs[static_cast<std::size_t>(run.ArcAt(t))].mode, now.mode);
    EXPECT_EQ(system.dof(), now.acceleration.size());
  }
  EXPECT_GE(passed, 1u);
  EXPECT_EQ(passed, session.events());
}

TEST(Session, InputsHoldFromTheirTimeOn) {
  Record record;
  Session session(Of("driven_ball"), {}, record.Log());
  session.SetInput(0.1, {"force"}, {9.8});
  ASSERT_EQ(1u, record.inputs.size());
  EXPECT_EQ(0.1, record.inputs[0].t);
  EXPECT_EQ(9.8, record.inputs[0].u(0));
  Go(&session, 0.05);
  EXPECT_EQ(0, session.Now().u(0));
  EXPECT_NEAR(-9.8, session.Now().acceleration(0), 1e-12);
  Go(&session, 0.3);
  EXPECT_EQ(9.8, session.Now().u(0));
  EXPECT_NEAR(0, session.Now().acceleration(0), 1e-12);
  EXPECT_NEAR(-0.98, session.State()(1), 1e-9);  // falls 0.1 s freely
  EXPECT_EQ(1u, session.epoch()) << "inputs begin no epoch";
}

TEST(Session, CommandsBeginEpochsFromThePresent) {
  Record record;
  Session session(Of("driven_ball"), {}, record.Log());
  session.TakeParametersChanged();
  Go(&session, 0.1);
  session.SetInput(1, {}, {2});
  const Vector before = session.State();
  session.ApplyImpulse({"z"}, {3});
  ASSERT_EQ(2u, record.epochs.size());
  const EpochBegin& push = record.epochs[1];
  EXPECT_EQ("apply_impulse", push.cause);
  EXPECT_EQ(0.1, push.t);
  EXPECT_EQ(0.1, push.t_before);
  EXPECT_NEAR(before(0), push.q_before(0), 1e-9);  // to the end of a step, in other bits
  EXPECT_NEAR(before(1), push.v_before(0), 1e-9);
  EXPECT_EQ(3, push.impulse(0));
  EXPECT_EQ(push.v_before(0) + 3, push.v(0));  // of 1 kg
  ASSERT_EQ(2u, record.inputs.size());
  EXPECT_EQ(1, record.inputs[1].t) << "what was told for later holds all the same";
  EXPECT_EQ(2u, record.inputs[1].epoch);

  session.SetParameters({"mass"}, {2});
  EXPECT_TRUE(session.TakeParametersChanged());
  EXPECT_EQ(2, record.epochs.back().parameters.front().value);
  AskedState state;
  state.names = {"z"};
  state.positions = {1};
  session.SetState(state);
  EXPECT_EQ("set_state", record.epochs.back().cause);
  EXPECT_EQ(1, session.State()(0));
  EXPECT_EQ(4u, session.epoch());

  session.ResetWorld();
  EXPECT_EQ(0.1, session.now());
  EXPECT_EQ(4, session.State()(0));
  EXPECT_GT(Go(&session, 1.2), 0);
  session.ResetSimulation();
  EXPECT_EQ(0, session.now());
  EXPECT_EQ(0u, session.events());
  EXPECT_EQ(1, record.epochs.back().parameters.front().value);
  EXPECT_EQ(6u, session.epoch());
}

TEST(Session, WhatIsRefusedChangesNothing) {
  Record record;
  Session session(Of("driven_ball"), {}, record.Log());
  Go(&session, 0.1);
  const Instant before = session.Now();
  AskedState state;
  state.names = {"x"};
  state.positions = {1};
  EXPECT_NE(std::string::npos, Refusal([&] { session.SetState(state); }).find("state.names[0]"));
  EXPECT_NE(std::string::npos, Refusal([&] { session.SetParameters({"mas"}, {2}); }).find("mass"));
  EXPECT_NE("", Refusal([&] { session.ApplyImpulse({}, {1, 2}); }));
  EXPECT_NE("", Refusal([&] { session.SetInput(0.2, {"thrust"}, {1}); }));
  AskedMark mark;
  mark.directions.names = {"+y"};
  EXPECT_NE(std::string::npos, Refusal([&] { session.Mark(mark); }).find("directions[0] is '+y'"));
  AskedPrediction prediction;
  EXPECT_NE(std::string::npos,
            Refusal([&] { session.AskPrediction(&prediction); }).find("horizon is 0"));
  EXPECT_TRUE(SameBits(before, session.Now()));
  EXPECT_EQ(1u, record.epochs.size());
  EXPECT_TRUE(record.inputs.empty());
  EXPECT_TRUE(record.marks.empty());
  EXPECT_TRUE(record.asked.empty());
}

/// A prediction is where the motion comes, and its fan what the mark carries along.
TEST(Session, PredictionsAndMarksAgree) {
  Record record;
  Session session(Of("driven_ball"), {"+z", "-d/dt z"}, record.Log());
  session.SetInput(0.5, {"force"}, {1});
  Go(&session, 0.2);
  AskedPrediction asked;
  asked.horizon = 0.9;  // beyond the touchdown at sqrt(2·4/9.8) s
  asked.directions.names = {"+z", "-d/dt z"};
  asked.size = 0.1;
  const Snapshot snapshot = session.AskPrediction(&asked);
  EXPECT_EQ(1u, asked.index);
  EXPECT_EQ(1u, asked.epoch);
  EXPECT_EQ(0.2, asked.t);
  ASSERT_EQ(1u, record.asked.size());
  const Directions marked = session.Mark(AskedMark());
  EXPECT_EQ(std::vector<std::string>({"+z", "-d/dt z"}), marked.names) << "those of the session";
  ASSERT_TRUE(session.marked());
  const Prediction prediction = Predict(snapshot, asked, {});
  session.TellPrediction(prediction);
  ASSERT_EQ(1u, record.predicted.size());
  EXPECT_EQ(Outcome::kOk, prediction.outcome) << prediction.message;
  EXPECT_EQ(1u, prediction.index);
  EXPECT_EQ(0.2, prediction.t_begin);
  EXPECT_EQ(std::vector<std::string>({"{}", "{floor}"}), prediction.event_names);
  EXPECT_EQ(0.5, prediction.event_times[0]) << "the input changes";

  Go(&session, 1.1);
  const Vector x = session.State();
  EXPECT_NEAR(x(0), prediction.q(0), 1e-8);
  EXPECT_NEAR(x(1), prediction.v(0), 1e-8);
  const std::optional<MarkReading> reading = session.ReadMark();
  ASSERT_TRUE(reading);
  EXPECT_EQ(0.2, reading->t_mark);
  EXPECT_EQ(marked.names, reading->names);
  EXPECT_TRUE(reading->now.status.ok()) << reading->now.status.message;
  ASSERT_EQ(2, prediction.derivatives.rows());
  EXPECT_LT((reading->now.tangents - prediction.derivatives.transpose()).norm(), 1e-7);
  EXPECT_GT(prediction.derivatives.norm(), 0.5);
  for (int j = 0; j < 2; ++j) {
    const Vector change = 0.1 * prediction.derivatives.row(j).transpose();
    EXPECT_NEAR(prediction.q(0) + change(0), prediction.fan(j, 0), 1e-14);
    EXPECT_NEAR(prediction.v(0) + change(1), prediction.fan(j, 1), 1e-14);
  }

  AskedMark none;
  none.clear = true;
  session.Mark(none);
  EXPECT_FALSE(session.marked());
  EXPECT_FALSE(session.ReadMark());
  ASSERT_EQ(2u, record.marks.size());
  EXPECT_EQ(0.2, record.marks[0].t);
  EXPECT_TRUE(record.marks[1].clear);
}

/// Directions that the contact mode does not admit are left out by default, or projected.
TEST(Session, MarksNoteWhatBecameOfDirections) {
  Session session(Configuration(), {}, {});
  Go(&session, 1.1);
  ASSERT_FALSE(session.mode().Empty());
  const Directions kept = session.Mark(AskedMark());
  ASSERT_FALSE(kept.notes.empty());
  EXPECT_EQ(DirectionNote::Kind::kLeftOut, kept.notes[0].kind);
  AskedMark mark;
  mark.directions.names = {"+body_x", "+left_foot_z"};
  EXPECT_NE(std::string::npos, Refusal([&] { session.Mark(mark); }).find("+left_foot_z"));
  mark.directions.project = true;
  const Directions projected = session.Mark(mark);
  EXPECT_EQ(mark.directions.names, projected.names);
  ASSERT_EQ(1u, projected.notes.size());
  EXPECT_EQ(DirectionNote::Kind::kProjected, projected.notes[0].kind);
}

/// Epochs, inputs and marks are all that it takes to repeat a session.
TEST(Session, ItsLogRepeatsIt) {
  Record record;
  Session session(Of("driven_ball"), {}, record.Log());
  session.SetInput(0.3, {}, {1});
  Go(&session, 0.95);
  session.ApplyImpulse({}, {0.5});
  session.SetInput(1.2, {}, {-1});
  session.Mark(AskedMark());
  Go(&session, 2);

  const EpochBegin& begin = record.epochs.back();
  Vector x(2);
  x << begin.q, begin.v;
  EpochRun again(session.setup(), begin.t, x, begin.u);
  again.Mark(record.marks.back());
  for (const ToldInput& input : record.inputs) {
    if (input.epoch == begin.epoch) again.flow()->SetInput(input.t, input.u);
  }
  while (again.flow()->now() < 2) again.AdvanceTo(2);
  EXPECT_TRUE(SameBits(session.Now(), again.Now()));
  EXPECT_TRUE(SameBits(*session.ReadMark(), *again.ReadMark()));
}

/// Whoever still makes a prediction when all ends may go on, or is told that it is cancelled.
TEST(Session, MayEndBeforeItsPredictions) {
  auto session =
      std::make_unique<Session>(Of("driven_ball"), std::vector<std::string>(), Session::Log());
  AskedPrediction asked;
  asked.horizon = 0.5;
  const Snapshot snapshot = session->AskPrediction(&asked);
  session->SetInput(1, {}, {1});
  session->Mark(AskedMark());
  session.reset();
  EXPECT_EQ(Outcome::kOk, Predict(snapshot, asked, {}).outcome);
  const Prediction cancelled = Predict(snapshot, asked, [] { return true; });
  EXPECT_EQ(Outcome::kCancelled, cancelled.outcome);
  EXPECT_EQ(0, cancelled.derivatives.size());
}

}  // namespace
}  // namespace contact_flow
