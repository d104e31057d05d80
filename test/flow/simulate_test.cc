// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/simulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate_batch.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Make;

/// y = c + A cos(t + φ), lowest (c − A) at t = π − φ.
Vector OscillatorState(double centre, double amplitude, double phase) {
  Vector x(2);
  x << centre + amplitude * std::cos(phase), -amplitude * std::sin(phase);
  return x;
}

TEST(Events, ShallowDipsInsideAStepAreAlwaysFound) {
  constexpr double kCentre = 1, kDepth = 1e-5;
  const auto system = Make<test::Oscillator>({{"centre", kCentre}});
  const double amplitude = kCentre + kDepth;
  for (int k = 0; k < 200; ++k) {
    const double phase = -0.1 - 2.8 * k / 200;
    const Trajectory run = Simulate(system, OscillatorState(kCentre, amplitude, phase), Vector(0),
                                    2 * M_PI, AtTolerance(1e-8));
    ASSERT_FALSE(run.transitions.empty()) << "phase " << phase;
    const double touch = std::acos(-kCentre / amplitude) - phase;
    // Speed at the crossing √(2·1e-5) = 4.5e-3: a state error of ~1e-8 moves the event by ~2e-6.
    EXPECT_NEAR(touch, run.transitions.front().t, 2e-5) << "phase " << phase;
  }
}

TEST(Events, NearMissesAreNoEventsButMargins) {
  constexpr double kCentre = 1, kClearance = 1e-5;
  const auto system = Make<test::Oscillator>({{"centre", kCentre}});
  for (int k = 0; k < 200; ++k) {
    const double phase = -0.1 - 2.8 * k / 200;
    const Trajectory run = Simulate(system, OscillatorState(kCentre, kCentre - kClearance, phase),
                                    Vector(0), 7, AtTolerance(1e-8));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_TRUE(run.transitions.empty()) << "phase " << phase;
    EXPECT_NEAR(kClearance, run.margins.gap, 1e-6);
  }
}

/// λ = load + cos(t + φ) dips below zero by 1e-5: a release, and the block comes down again.
TEST(Events, ShallowDipsOfAForceAreFound) {
  constexpr double kDepth = 1e-5;
  const auto system = Make<test::PressedBlock>({{"load", 1 - kDepth}});
  for (int k = 0; k < 100; ++k) {
    const double phase = -2.9 + 2.8 * k / 100;
    Vector x(4);
    x << 0, phase, 0, 1;
    const Trajectory run = Simulate(system, x, Vector(0), 6.3, AtTolerance(1e-8));
    ASSERT_FALSE(run.transitions.empty()) << "phase " << phase;
    EXPECT_EQ(ConstraintSet({0}), run.transitions.front().released);
    const double release = std::acos(-(1 - kDepth)) - phase;
    EXPECT_NEAR(release, run.transitions.front().t, 2e-5) << "phase " << phase;
  }
}

TEST(Events, GrazingIsPassedAndNamesConstraintAndTime) {
  const auto system = Make<test::Oscillator>();
  const Trajectory run =
      Simulate(system, OscillatorState(1, 1, -1), Vector(0), 10, AtTolerance(1e-10));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.warnings.size());
  EXPECT_EQ(Outcome::kGrazing, run.warnings[0].code);
  EXPECT_NE(std::string::npos, run.warnings[0].message.find("'floor'"));
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(ConstraintSet({0}), run.transitions[0].grazed);
  EXPECT_NEAR(M_PI + 1, run.transitions[0].t, 1e-4);
  EXPECT_EQ(10, run.t_end());
  EXPECT_EQ(0, run.margins.approach_speed);
  EXPECT_NEAR(1 + std::cos(1.0), run.State(2)(0), 1e-8) << "the run up to there is kept";
}

TEST(Events, ContactsThatLetGoTogetherDoNotGraze) {
  // A foot that joined a cluster rests some picometres above the ground, more than the floor of the
  // search; once both let go, its speed is of the order of rounding, and may point down.
  const auto trot = MakeModel("hopping_trot");
  for (double offset : {4.46e-12, -4.46e-12, 3e-11}) {
    Vector x = trot->nominal().x;
    x(offset > 0 ? 4 : 5) += std::abs(offset);
    const Trajectory run = Simulate(*trot, x, Vector(0), 0.8, AtTolerance(1e-12));
    EXPECT_TRUE(run.status.ok()) << offset << ": " << run.status.message;
    const bool at_once = std::abs(offset) < 1e-11;  // ten tolerances
    EXPECT_EQ(at_once ? 2u : 3u, run.transitions.size());
  }
}

TEST(Status, ZenoPredictsTheAccumulation) {
  constexpr double kGravity = 9.81, kRestitution = 0.7;
  const auto system =
      MakeModel("ball_in_corner", {{"gravity", kGravity}, {"restitution", kRestitution}});
  Vector x(4);
  x << 5, 1, 0, 0;
  const Trajectory run = Simulate(*system, x, Vector(0), 10, AtTolerance(1e-11));
  EXPECT_EQ(Outcome::kZeno, run.status.outcome) << run.status.message;
  const double fall = std::sqrt(2 / kGravity);
  const double exact = fall * (1 + 2 * kRestitution / (1 - kRestitution));
  EXPECT_NEAR(exact, run.accumulation_time, 1e-7);
  EXPECT_LT(run.t_end(), exact);
  EXPECT_EQ(run.arcs.size(), run.transitions.size() + 1);
}

TEST(Status, ZenoMayBeCompletedToSticking) {
  const auto system = MakeModel("ball_in_corner");
  Vector x(4);
  x << 5, 1, -0.5, 0;
  SimulateOptions options = AtTolerance(1e-11);
  options.complete_zeno = true;
  const Trajectory run = Simulate(*system, x, Vector(0), 8, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ(ContactMode({0}), run.ModeSequence().back());
  EXPECT_TRUE(run.transitions.back().completes_zeno);
  // The ball rolls on: x(8) = 5 − 0.5·8, and rests on the floor up to the last
  // bounce that was flown.
  EXPECT_NEAR(1, run.FinalState()(0), 1e-9);
  EXPECT_NEAR(0, run.FinalState()(1), 1e-9);
  EXPECT_NEAR(0, run.FinalState()(3), 1e-12);
  const BDerivative B = DifferentiateOutcome(*system, run);
  EXPECT_EQ(Outcome::kZeno, B.status.outcome) << "no derivative across it";
}

/// Plastic impacts accumulate too: a block rocks from corner to corner, each time for
/// a shorter while.
TEST(Status, ARockingBlockComesToRest) {
  const auto system = MakeModel("rocking_block");
  const Vector x = system->nominal().x;
  SimulateOptions options;
  const Trajectory stopped = Simulate(*system, x, Vector(0), 2, options);
  ASSERT_EQ(Outcome::kZeno, stopped.status.outcome);
  options.zeno_interval = 1e-3;  // predicted far earlier: the same instant, up to second order
  const Trajectory early = Simulate(*system, x, Vector(0), 2, options);
  EXPECT_LT(early.transitions.size(), stopped.transitions.size());
  EXPECT_NEAR(stopped.accumulation_time, early.accumulation_time, 1e-4);
  EXPECT_LT(stopped.t_end(), stopped.accumulation_time);
  options = {};
  options.complete_zeno = true;
  const Trajectory rest = Simulate(*system, x, Vector(0), 2, options);
  ASSERT_TRUE(rest.status.ok()) << rest.status.message;
  EXPECT_EQ(ContactMode({0, 1}), rest.ModeSequence().back());
  EXPECT_LE(rest.FinalState().tail(3).cwiseAbs().maxCoeff(), 1e-9) << "it stands";
  EXPECT_NEAR(0, rest.FinalState()(2), 1e-5) << "upright, up to the rocking that was left";
}

TEST(Status, BudgetsStopARunAndKeepIt) {
  const auto system = MakeModel("ball_in_corner");
  SimulateOptions options;
  options.max_events = 2;
  const Trajectory few = Simulate(*system, system->nominal().x, Vector(0), 3, options);
  EXPECT_EQ(Outcome::kBudgetExceeded, few.status.outcome);
  EXPECT_EQ(2u, few.transitions.size());
  EXPECT_EQ(3u, few.arcs.size());
  EXPECT_GT(few.t_end(), few.transitions.back().t);

  options = {};
  options.max_steps = 3;
  const Trajectory short_run = Simulate(*system, system->nominal().x, Vector(0), 3, options);
  EXPECT_EQ(Outcome::kBudgetExceeded, short_run.status.outcome);
  EXPECT_EQ(3, short_run.statistics.steps + short_run.statistics.rejected_steps);
}

TEST(Status, ARunCanBeCancelled) {
  const auto system = MakeModel("soft_biped");
  SimulateOptions options;
  options.cancelled = [] { return true; };
  const Trajectory run = Simulate(*system, system->nominal().x, Vector(0), 1, options);
  EXPECT_EQ(Outcome::kCancelled, run.status.outcome);
  EXPECT_EQ(1u, run.arcs.size());
}

TEST(Status, EscapeToInfinityIsReported) {
  const auto system = Make<test::Escape>();
  Vector x(2);
  x << 0, 1;  // ẋ = 1/(1−t)
  const Trajectory run = Simulate(system, x, Vector(0), 2);
  EXPECT_FALSE(run.status.ok());
  EXPECT_NEAR(1, run.t_end(), 1e-3);
}

TEST(Trajectories, StatesAgreeWithRunsThatStopThere) {
  const auto system = MakeModel("hopping_trot");
  const Vector x = system->nominal().x, u = system->nominal().u;
  const Trajectory run = Simulate(*system, x, u, 0.8, AtTolerance(1e-11));
  for (double t : {0.0, 0.05, 0.0999, 0.31, 0.65, 0.75, 0.8}) {
    const Vector stopped = Simulate(*system, x, u, t, AtTolerance(1e-11)).FinalState();
    EXPECT_LE((run.State(t) - stopped).cwiseAbs().maxCoeff(), 1e-8) << "t = " << t;
  }
}

TEST(Trajectories, AreLeftContinuousAtEvents) {
  const auto system = MakeModel("ball_in_corner");
  const Trajectory run = Simulate(*system, system->nominal().x, Vector(0), 1);
  ASSERT_EQ(1u, run.transitions.size());
  const Transition& bounce = run.transitions.front();
  EXPECT_EQ(bounce.x_minus, run.State(bounce.t));
  EXPECT_LT(bounce.x_minus(3), 0);
  EXPECT_GT(bounce.x_plus(3), 0);
  EXPECT_EQ(bounce.x_plus, run.arcs[1].x_begin);
}

TEST(Trajectories, TheImpactLawIsAnOption) {
  const auto system = MakeModel("rigid_biped");
  Vector x = system->nominal().x;
  x(2) = 1e-3;
  SimulateOptions options;
  const Trajectory run = Simulate(*system, x, Vector(0), 1.01, options);
  EXPECT_EQ(ContactMode({1}), run.ModeSequence().back()) << "the foot that landed first lets go";
  options.impact_law = ImpactLaw::kProjection;
  const Trajectory literal = Simulate(*system, x, Vector(0), 1.01, options);
  EXPECT_LT(literal.transitions.back().impulse.minCoeff(), 0) << "the projection holds and pulls";
}

/// A wall that is met first lets go of what then falls on the floor, however shortly behind.
TEST(Trajectories, TheProjectionHoldsNothingThatHasLetGo) {
  const auto corner = MakeModel("corner", {{"angle", 1.380844185017728}, {"restitution", 0}});
  for (const double early : {1e-2, 1e-3, 1e-5, 1e-6, 1e-7}) {
    const Vector x = corner->nominal().x + early * Eigen::Vector4d(-1, 0.3, 0, 0);
    Vector ends[2];
    for (const ImpactLaw law : test::kImpactLaws) {
      SimulateOptions options = test::Tight();
      options.impact_law = law;
      const Trajectory run =
          Simulate(*corner, x, corner->nominal().u, corner->nominal().duration, options);
      ASSERT_EQ(2u, run.transitions.size()) << early;
      EXPECT_NEAR(0.790259, run.transitions.back().x_plus(2), early + 1e-6) << early;
      ends[law == ImpactLaw::kProjection] = run.FinalState();
    }
    EXPECT_LT((ends[0] - ends[1]).norm(), 1e-9) << early;
  }
}

TEST(Refusals, NameFieldAndValue) {
  const auto system = MakeModel("soft_biped");
  const Vector nominal = system->nominal().x;
  const auto refusal = [&](const Vector& x, double duration) -> std::string {
    try {
      Simulate(*system, x, Vector(0), duration);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const auto mentions = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  Vector x = nominal;
  x(4) = -0.1;
  EXPECT_TRUE(mentions(refusal(x, 1), "'left_foot' is -0.1")) << refusal(x, 1);
  x(4) = 0;
  x(11) = -2;
  EXPECT_TRUE(mentions(refusal(x, 1), "'left_foot' is -2")) << refusal(x, 1);
  x = nominal;
  x(3) = std::nan("");
  EXPECT_TRUE(mentions(refusal(x, 1), "'body_z' is nan")) << refusal(x, 1);
  x(3) = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(mentions(refusal(x, 1), "'body_z' is inf")) << refusal(x, 1);
  EXPECT_TRUE(mentions(refusal(nominal.head(5), 1), "has 5 entries: 14 are needed"));
  EXPECT_TRUE(mentions(refusal(nominal, -1), "duration is -1"));
  EXPECT_TRUE(mentions(refusal(nominal, std::nan("")), "duration is nan"));
  EXPECT_EQ("", refusal(nominal, 0)) << "an empty run is a run";
  SimulateOptions options;
  options.relative_tolerance = -1;
  EXPECT_THROW(Validate(options), std::invalid_argument);
}

TEST(InitialModes, FollowForceComplementarity) {
  const auto system = MakeModel("wall_and_floor");
  EXPECT_EQ(ContactMode({0}), InitialMode(*system, system->nominal().x, Vector(0)));
  Vector lifted = system->nominal().x;
  lifted(1) = 0.5;
  EXPECT_EQ(ContactMode(), InitialMode(*system, lifted, Vector(0)));
  Vector pulled = system->nominal().x;
  pulled(2) = 3;  // the clock's force now points up: the floor would have to pull
  EXPECT_EQ(ContactMode(), InitialMode(*system, pulled, Vector(0)));
}

/// The errors of the last two arcs tell how well an instant is known; bounces turn them and do not
/// add to them.
TEST(Instants, OfManyBouncesStayKnown) {
  const auto ball = MakeModel("bouncing_ball", {{"restitution", 1.0}});
  const Trajectory run = Simulate(*ball, ball->nominal().x, Vector(0), 60);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GT(run.transitions.size(), 50u);
  for (const Transition& transition : run.transitions) {
    EXPECT_LE(transition.tolerance, 1e-8) << "at t = " << transition.t;
  }
}

/// A speed below the tolerance counts as none of a contact that rests: what the start has of it is
/// gone, and dampers do not carry it to carts that come at their terminal speeds.
TEST(Simulate, WhatBeginsAtRestHasNoSpeed) {
  const auto plate = MakeModel("damped_plate");
  for (const double speed : {-9e-7, 9e-7}) {
    Vector x = plate->nominal().x;
    x(3) = speed;
    const Trajectory run = Simulate(*plate, x, Vector(0), 0.19);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(ContactMode({0}), run.arcs[0].mode);
    EXPECT_EQ(0, run.arcs[0].x_begin(3));
    for (int cart = 1; cart <= 2; ++cart) {
      EXPECT_NEAR(x(cart) + 0.19 * x(3 + cart), run.FinalState()(cart), 1e-13);
    }
    const BatchResult lanes = SimulateBatch(*plate, x.replicate(1, 4), Matrix(0, 1), 0.19);
    for (const BatchRun& lane : lanes.runs) EXPECT_EQ(run.FinalState(), lane.final_state);
  }
}

}  // namespace
}  // namespace contact_flow
