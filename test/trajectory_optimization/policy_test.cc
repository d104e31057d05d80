// SPDX-License-Identifier: BSD-3-Clause
// Policies: references beyond their events in closed form, gains against the quadratic program that
// they solve, touchdowns that come early, late, not at all, or that nobody expects.
#include "contact_flow/trajectory_optimization/policy.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <memory>

#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/trajectory_optimization/driven_ball.h"

namespace contact_flow {
namespace {

using test::kBallGravity;
using test::kBallRestitution;

/// A ball falls from 1 m and bounces once or twice while its input alternates.
class BallPolicy : public testing::Test {
 protected:
  BallPolicy() : ball(MakeModel("driven_ball")) {
    for (int k = 0; k < 40; ++k) {
      inputs.grid.push_back(0.02 * k);
      inputs.values.push_back(Vector::Constant(1, k % 2 == 0 ? 1 : -1));
    }
    exact.relative_tolerance = exact.absolute_tolerance = 1e-12;
    weights.state = Eigen::Vector2d(100, 1);
    weights.input = Vector::Constant(1, 0.01);
    weights.terminal = Eigen::Vector2d(100, 1);
  }

  Trajectory Run() const { return Simulate(*ball, Eigen::Vector2d(1, 0), inputs, 0.8, exact); }
  ExtendedReference Reference(double reach) const { return {*ball, Run(), inputs, reach}; }
  TrackingPolicy Made() const { return MakePolicy(*ball, Run(), inputs, 0.1, weights); }

  /// The closed loop at 1 kHz from `height` with another restitution; the largest error of the
  /// height against the reference away from its events, and the largest input.
  struct Loop {
    double end_error = 0, largest_input = 0;
    std::vector<TrackedEvent> events;
  };
  Loop Close(const TrackingPolicy& policy, double height, double restitution, bool extend) const {
    ParameterValues values;
    values["restitution"] = restitution;
    const std::shared_ptr<const MechanicalSystem> other = MakeModel("driven_ball", values);
    TrackerOptions options;
    options.extend = extend;
    PolicyTracker tracker(policy, options);
    OnlineFlow flow(other, 0, Eigen::Vector2d(height, 0), Vector::Zero(1), exact);
    Loop loop;
    for (int i = 0; i < 800; ++i) {
      const double t = 1e-3 * i;
      while (flow.AdvanceTo(t)) {
        const Transition& event = flow.transition();
        if (event.changes_input) continue;
        tracker.Observe(event.t, event.activated, event.released);
      }
      const Vector u = tracker.Input(t, flow.State());
      loop.largest_input = std::max(loop.largest_input, std::abs(u(0)));
      flow.SetInput(t, u);
    }
    while (flow.AdvanceTo(0.8)) {
    }
    loop.end_error = std::abs(flow.State()(0) - policy.reference.phases().back().x_end(0));
    loop.events = tracker.events();
    return loop;
  }

  const std::unique_ptr<MechanicalSystem> ball;
  InputSchedule inputs;
  SimulateOptions exact;
  TrackingWeights weights;
};

TEST_F(BallPolicy, ReferenceGoesOnBeyondItsEvents) {
  for (Vector& value : inputs.values) value.setZero();
  const ExtendedReference reference = Reference(0.1);
  const double t = std::sqrt(2 / kBallGravity), v = kBallGravity * t;
  ASSERT_EQ(2u, reference.phases().size());
  EXPECT_NEAR(t, reference.phases()[0].t_end, 1e-10);
  EXPECT_EQ(0, reference.PhaseAt(t - 0.01));
  EXPECT_EQ(1, reference.PhaseAt(t + 0.01));
  for (double s : {0.0, 0.003, 0.05, 0.0999}) {
    const Vector late = reference.State(0, t + s);  // through the floor
    EXPECT_NEAR(-v * s - kBallGravity * s * s / 2, late(0), 1e-9) << s;
    EXPECT_NEAR(-v - kBallGravity * s, late(1), 1e-9) << s;
    const Vector early = reference.State(1, t - s);
    EXPECT_NEAR(-kBallRestitution * v * s - kBallGravity * s * s / 2, early(0), 1e-9) << s;
    EXPECT_NEAR(kBallRestitution * v + kBallGravity * s, early(1), 1e-9) << s;
  }
  // Not further than its reach.
  EXPECT_EQ(reference.State(0, t + 0.2), reference.State(0, t + 0.3));
}

/// With inputs that change: the motion of a ball without floor.
TEST_F(BallPolicy, ReferenceGoesOnUnderItsInputs) {
  const ExtendedReference reference = Reference(0.15);
  const double end = reference.phases()[0].t_end;
  ParameterValues far;
  const Trajectory free = Simulate(*ball, Eigen::Vector2d(101, 0), inputs, 0.8, exact);
  for (double s : {0.01, 0.07, 0.14}) {
    const Vector expected = free.State(end + s) - Eigen::Vector2d(100, 0);
    EXPECT_LT((reference.State(0, end + s) - expected).norm(), 1e-9) << s;
  }
  // Forward again from where it has gone back to.
  const double begin = reference.phases()[1].t_begin;
  const Vector back = reference.State(1, begin - 0.1);
  InputSchedule rest;
  for (std::size_t k = 0; k < inputs.grid.size(); ++k) {
    const double t = inputs.grid[k] - (begin - 0.1);
    if (k + 1 < inputs.grid.size() && inputs.grid[k + 1] <= begin - 0.1) continue;
    rest.grid.push_back(std::max(t, 0.0));
    rest.values.push_back(inputs.values[k]);
  }
  const Trajectory again = Simulate(*ball, back + Eigen::Vector2d(100, 0), rest, 0.1, exact);
  EXPECT_LT((again.FinalState() - Eigen::Vector2d(100, 0) - reference.phases()[1].x_begin).norm(),
            1e-9);
}

/// δu_0 = −K_0 δx_0 is the first step of min Σ h (δxᵀQδx + δuᵀRδu) + δx_TᵀQ_Tδx_T, as one
/// least-squares problem in all δu.
TEST_F(BallPolicy, GainsAreThoseOfTheQuadraticProgram) {
  const TrackingPolicy policy = Made();
  const ExtendedReference& reference = policy.reference;
  const std::vector<IntervalLinearization> intervals = Linearize(*ball, Run());
  const auto count = static_cast<Eigen::Index>(intervals.size());
  ASSERT_EQ(count, static_cast<Eigen::Index>(policy.gains.size()));
  const Eigen::Vector2d start(0.3, -0.2);
  Matrix rows = Matrix::Zero(3 * count + 2, count);
  Vector right = Vector::Zero(3 * count + 2);
  Matrix S = Matrix::Zero(2, count);  // δx_k by δu
  Vector free = start;                // δx_k by δx_0
  for (Eigen::Index k = 0; k < count; ++k) {
    const IntervalLinearization& interval = intervals[static_cast<std::size_t>(k)];
    const double h = interval.t_end - interval.t_begin;
    const Vector q = (h * weights.state).cwiseSqrt();
    rows.middleRows(3 * k, 2) = q.asDiagonal() * S;
    right.segment(3 * k, 2) = -q.cwiseProduct(free);
    rows(3 * k + 2, k) = std::sqrt(h * weights.input(0));
    S = (interval.A * S).eval();
    S.col(k) += interval.B;
    free = (interval.A * free).eval();
  }
  const Vector q = weights.terminal.cwiseSqrt();
  rows.bottomRows(2) = q.asDiagonal() * S;
  right.tail(2) = -q.cwiseProduct(free);
  const Vector best = rows.colPivHouseholderQr().solve(right);
  EXPECT_NEAR(best(0), -(policy.gains[0] * start)(0), 1e-8 * best.cwiseAbs().maxCoeff());
  EXPECT_EQ(0, policy.gain_phases.front());
  EXPECT_EQ(static_cast<int>(reference.phases().size()) - 1, policy.gain_phases.back());
}

/// From higher and lower the touchdown comes late and early, as a weak feedback does not get there
/// before. With extended references the input stays what it was; without, it jumps meanwhile by the
/// gain of the velocity times (1+γ) of the speed of the impact.
TEST_F(BallPolicy, EarlyAndLateTouchdownsDoNotJumpTheFeedback) {
  weights.state = Eigen::Vector2d(10, 1);
  weights.terminal = Eigen::Vector2d(1, 1);
  weights.input(0) = 1;
  const TrackingPolicy policy = Made();
  for (double height : {0.85, 0.95, 1.05, 1.15}) {
    const Loop with = Close(policy, height, kBallRestitution, true);
    const Loop without = Close(policy, height, kBallRestitution, false);
    ASSERT_FALSE(with.events.empty());
    EXPECT_EQ(height < 1 ? TrackedEvent::Kind::kEarly : TrackedEvent::Kind::kLate,
              with.events.front().kind)
        << height << KindName(with.events.front().kind);
    std::printf(
        "from %.2f m: largest input %.1f N with extension, %.1f N without; error at the "
        "end %.2g and %.2g m\n",
        height, with.largest_input, without.largest_input, with.end_error, without.end_error);
    EXPECT_LE(with.largest_input, without.largest_input + 1e-9) << height;
    EXPECT_LT(with.largest_input, 2) << height;  // 1 N is fed forward
    // At 0.95 m the touchdown falls into the interval of the reference's, whose gain is small.
    if (height != 0.95) {
      EXPECT_LT(with.largest_input, 0.5 * without.largest_input) << height;
    }
  }
  const Loop same = Close(policy, 1, kBallRestitution, true);
  EXPECT_EQ(TrackedEvent::Kind::kOnTime, same.events.front().kind);
  EXPECT_LT(same.end_error, 1e-2);
}

TEST_F(BallPolicy, MissedAndExtraTouchdownsAreReported) {
  const TrackingPolicy policy = Made();
  const double hit = policy.reference.phases()[0].t_end;
  PolicyTracker tracker(policy);
  EXPECT_EQ(0, tracker.phase());
  tracker.Observe(0.1, {}, {0});  // nothing lets go in the reference
  ASSERT_EQ(1u, tracker.events().size());
  EXPECT_EQ(TrackedEvent::Kind::kExtra, tracker.events()[0].kind);
  EXPECT_EQ(0, tracker.phase());
  tracker.Input(hit + 0.09, Eigen::Vector2d(0.1, -1));
  EXPECT_EQ(0, tracker.phase());
  tracker.Input(hit + 0.11, Eigen::Vector2d(0.1, -1));
  EXPECT_EQ(1, tracker.phase());
  ASSERT_EQ(2u, tracker.events().size());
  EXPECT_EQ(TrackedEvent::Kind::kMissed, tracker.events()[1].kind);
  EXPECT_NEAR(hit, tracker.events()[1].expected, 1e-12);
}

/// A reference of four phases in the modes {}, {0}, {1}, {0, 1}, as a ball's but for those.
TEST_F(BallPolicy, FeetInAnotherOrderAreNotWaitedFor) {
  TrackingPolicy policy = Made();
  std::vector<ReferencePhase> phases(4, policy.reference.phases()[0]);
  const ConstraintSet modes[] = {{}, {0}, {1}, {0, 1}};
  for (std::size_t k = 0; k < 4; ++k) {
    phases[k].mode = ContactMode(modes[k]);
    phases[k].t_begin = k == 0 ? 0 : 0.2 + 0.001 * static_cast<double>(k);
    phases[k].t_end = k == 3 ? 0.8 : 0.2 + 0.001 * static_cast<double>(k + 1);
  }
  phases[0].activated = {0};
  phases[1].activated = {1};
  phases[1].released = {0};
  phases[2].activated = {0};
  policy.reference = ExtendedReference(policy.reference.space(), inputs, phases);
  using Kind = TrackedEvent::Kind;
  const auto kinds = [](const PolicyTracker& tracker) {
    std::vector<Kind> all;
    for (const TrackedEvent& event : tracker.events()) all.push_back(event.kind);
    return all;
  };
  // Both feet at once, late; the one after the other; the other foot alone: of the first one's
  // touchdown there is nothing to see.
  PolicyTracker together(policy);
  together.Observe(0.21, {0, 1}, {}, ConstraintSet{0, 1});
  EXPECT_EQ(3, together.phase());
  EXPECT_EQ((std::vector<Kind>{Kind::kLate, Kind::kLate, Kind::kLate}), kinds(together));
  PolicyTracker in_turn(policy);
  in_turn.Observe(0.19, {0}, {}, ConstraintSet{0});
  EXPECT_EQ(1, in_turn.phase());
  in_turn.Observe(0.195, {1}, {}, ConstraintSet{0, 1});
  EXPECT_EQ(3, in_turn.phase());
  EXPECT_EQ((std::vector<Kind>{Kind::kEarly, Kind::kEarly, Kind::kMissed, Kind::kMissed}),
            kinds(in_turn));
  PolicyTracker other(policy);
  other.Observe(0.2, {1}, {}, ConstraintSet{1});
  EXPECT_EQ(2, other.phase());
  // Not without being told the mode, not when that phase is far away, and not by other contacts.
  PolicyTracker blind(policy);
  blind.Observe(0.21, {1}, {});
  EXPECT_EQ(0, blind.phase());
  PolicyTracker far(policy);
  far.Observe(0.05, {0, 1}, {}, ConstraintSet{0, 1});
  EXPECT_EQ(0, far.phase());
  EXPECT_EQ(std::vector<Kind>{Kind::kExtra}, kinds(far));
  // What came far too early waits for its phase.
  far.Input(0.15, Eigen::Vector2d(0.1, -1));
  EXPECT_EQ(3, far.phase());
  PolicyTracker strange(policy);
  strange.Observe(0.2, {1, 2}, {}, ConstraintSet{1});
  EXPECT_EQ(0, strange.phase());
}

/// Phases {}, {0}, {0, 1}: the second foot first. It has come for its phase, and is told once,
/// unless it lets go again.
TEST_F(BallPolicy, AFootThatIsAheadIsNotMissed) {
  TrackingPolicy policy = Made();
  std::vector<ReferencePhase> phases(3, policy.reference.phases()[0]);
  const ConstraintSet modes[] = {{}, {0}, {0, 1}};
  const double ends[] = {0.2, 0.23, 0.8};
  for (std::size_t k = 0; k < 3; ++k) {
    phases[k].mode = ContactMode(modes[k]);
    phases[k].t_begin = k == 0 ? 0 : ends[k - 1];
    phases[k].t_end = ends[k];
    phases[k].activated = k < 2 ? ConstraintSet({static_cast<int>(k)}) : ConstraintSet();
  }
  policy.reference = ExtendedReference(policy.reference.space(), inputs, phases);
  using Kind = TrackedEvent::Kind;
  for (bool told : {false, true}) {
    const auto mode = [told](ConstraintSet set) {
      return told ? std::optional<ConstraintSet>(set) : std::nullopt;
    };
    PolicyTracker tracker(policy);
    tracker.Observe(0.19, {1}, {}, mode({1}));
    EXPECT_EQ(0, tracker.phase());
    tracker.Input(0.2, Eigen::Vector2d(0.1, -1));
    tracker.Observe(0.21, {0}, {}, mode({0, 1}));
    EXPECT_EQ(2, tracker.phase());
    tracker.Input(0.5, Eigen::Vector2d(0.1, -1));
    ASSERT_EQ(2u, tracker.events().size());
    EXPECT_EQ(Kind::kEarly, tracker.events()[0].kind);
    EXPECT_EQ(0.23, tracker.events()[0].expected);
    EXPECT_EQ(ConstraintSet({1}), tracker.events()[0].constraints);
    EXPECT_EQ(Kind::kLate, tracker.events()[1].kind);
    EXPECT_EQ(ConstraintSet({0}), tracker.events()[1].constraints);

    PolicyTracker again(policy);
    again.Observe(0.17, {1}, {}, mode({1}));
    again.Observe(0.18, {}, {1}, mode({}));
    again.Observe(0.2, {0}, {}, mode({0}));
    EXPECT_EQ(1, again.phase());
    again.Observe(0.23, {1}, {}, mode({0, 1}));
    EXPECT_EQ(2, again.phase());
    EXPECT_EQ(Kind::kOnTime, again.events().back().kind);
  }
}

/// As an event at which the input alone changes: the mode is that of the phase, and of the next.
TEST_F(BallPolicy, NothingComesOfAnObservationOfNothing) {
  const TrackingPolicy policy = Made();
  const double hit = policy.reference.phases()[0].t_end;
  PolicyTracker tracker(policy);
  tracker.Observe(hit - 0.05, {}, {}, ConstraintSet());
  tracker.Observe(hit - 0.04, {}, {});
  EXPECT_EQ(0, tracker.phase());
  EXPECT_TRUE(tracker.events().empty());
}

/// Where a foot that slides comes to rest, nobody tells: the phase ends by its time.
TEST_F(BallPolicy, PhasesThatEndWithoutAnEventOfContactsEndByTime) {
  TrackingPolicy policy = Made();
  std::vector<ReferencePhase> phases = policy.reference.phases();
  phases[0].activated = ConstraintSet();
  policy.reference = ExtendedReference(policy.reference.space(), inputs, phases);
  PolicyTracker tracker(policy);
  tracker.Input(phases[0].t_end - 1e-6, Eigen::Vector2d(1, 0));
  EXPECT_EQ(0, tracker.phase());
  tracker.Input(phases[0].t_end + 1e-6, Eigen::Vector2d(1, 0));
  EXPECT_EQ(1, tracker.phase());
  EXPECT_TRUE(tracker.events().empty());
}

TEST_F(BallPolicy, MisuseIsRefused) {
  EXPECT_THROW(Reference(-1), std::invalid_argument);
  weights.input(0) = 0;
  EXPECT_THROW(Made(), std::invalid_argument);
  weights.input(0) = 1;
  weights.state = Vector::Ones(3);
  EXPECT_THROW(Made(), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
