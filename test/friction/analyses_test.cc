// SPDX-License-Identifier: BSD-3-Clause
// What is built on derivatives, for systems that stick and slip: beside differences of runs, closed
// forms and samples.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "contact_flow/analysis/input_map.h"
#include "contact_flow/analysis/outcome_cost.h"
#include "contact_flow/analysis/periodic_orbit.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/continued_outcomes.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/controllability.h"
#include "contact_flow/piecewise_linear/covariance.h"
#include "contact_flow/piecewise_linear/descent.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/section.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "test/friction/friction_case.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

using SystemPointer = std::shared_ptr<const MechanicalSystem>;

/// Swung by 6 sin(3 t) N over a cone of 4.905 N: it sticks, slips forward, stops, slips backward.
SystemPointer SwungBlock(double stiffness = 0) {
  return MakeModel("block_on_incline",
                   {{"incline", 0}, {"amplitude", 6}, {"frequency", 3}, {"stiffness", stiffness}});
}
Vector AtRest(double t) {
  Vector x = Vector::Zero(6);
  x(2) = t;
  x(5) = 1;
  return x;
}

std::string LettersOf(const Trajectory& run) {
  std::string words;
  for (const Arc& arc : run.arcs) {
    const std::string word = arc.mode.Word(1);
    if (words.empty() || words.substr(words.size() - 1) != word) words += word;
  }
  return words;
}

/// With steps of 1e-5 central differences leave 1e-10 of third derivatives (below 1e3), and 1e-12
/// of the runs over the step: 1e-7. One-sided ones 1e-5 of second derivatives.
constexpr double kStep = 1e-5, kCentral = 3e-6, kOneSided = 1e-3;

/// Each interval begins and ends in stick or in slip, and holds a change or none.
TEST(FrictionAnalyses, IntervalsOfInputsAreLinearized) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const SystemPointer block = SwungBlock();
  const InputSchedule inputs{
      {0, 0.2, 0.6, 0.9, 1.15, 1.6, 1.9},
      {Vector::Constant(1, 0.5), Vector::Constant(1, 0.9), Vector::Constant(1, -1),
       Vector::Constant(1, 0.2), Vector::Constant(1, -2), Vector::Constant(1, 0.7),
       Vector::Constant(1, 0)}};
  const Trajectory run = Simulate(*block, AtRest(0), inputs, 2.3, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_EQ("s+s-s", LettersOf(run).substr(0, 5));
  const std::vector<IntervalLinearization> intervals = Linearize(*block, run);
  ASSERT_EQ(inputs.grid.size(), intervals.size());
  const std::vector<int> tangents = {0, 2, 3, 5};  // along the floor, and the clock
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    const IntervalLinearization& one = intervals[k];
    ASSERT_TRUE(one.status.ok()) << k << one.status.message;
    EXPECT_TRUE(one.is_linear) << k;
    const auto end = [&](const Vector& w) {
      const Vector u = inputs.values[k] + w.tail(1);
      const Trajectory moved =
          Simulate(*block, one.x_begin + w.head(6), u, one.t_end - one.t_begin, Tight());
      EXPECT_TRUE(moved.status.ok()) << moved.status.message;
      return moved.FinalState();
    };
    Matrix AB(6, 7);
    AB << one.A, one.B;
    for (int j : {0, 2, 3, 5, 6}) {
      const Vector w = kStep * Vector::Unit(7, j);
      const Vector quotient = (end(w) - end(-w)) / (2 * kStep);
      // A sticking start that is made to slip stops after a time of first order: O(step).
      const bool stuck = j == 3 && std::abs(one.x_begin(3)) < 1e-12;
      EXPECT_LE((AB.col(j) - quotient).cwiseAbs().maxCoeff(), stuck ? kOneSided : kCentral)
          << "interval " << k << ", column " << j;
    }
  }
  // Composed: the outcome by all inputs.
  const PiecewiseLinearMap map = InputMap(intervals);
  ASSERT_EQ(1u, map.pieces().size());
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    const auto end = [&](double du) {
      InputSchedule moved = inputs;
      moved.values[k](0) += du;
      return Simulate(*block, AtRest(0), moved, 2.3, Tight()).FinalState();
    };
    const Vector quotient = (end(kStep) - end(-kStep)) / (2 * kStep);
    const Vector unit = Vector::Unit(map.cols(), static_cast<Eigen::Index>(k));
    EXPECT_LE((map(unit) - quotient).cwiseAbs().maxCoeff(), kCentral) << k;
  }
}

/// While it slips both position and speed obey, after a stop the speed does not.
TEST(FrictionAnalyses, ControllabilityIsLostByAStop) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const SystemPointer block = SwungBlock();
  const InputSchedule inputs{{0, 0.25, 0.5}, std::vector<Vector>(3, Vector::Zero(1))};
  const auto reachable = [&](double duration, const std::string& word) {
    const Trajectory run = Simulate(*block, AtRest(0), inputs, duration, Tight());
    EXPECT_EQ(word, LettersOf(run));
    const PiecewiseLinearMap map = InputMap(Linearize(*block, run));
    const ControllabilityReport report = AssessControllability(map);
    EXPECT_EQ(ControllabilityVerdict::kControllable, report.verdict) << report.message;
    return report.reachable;
  };
  const Matrix slipping = reachable(0.7, "s+");
  EXPECT_EQ(2, slipping.cols());
  const Matrix stopped = reachable(1.2, "s+s");
  ASSERT_EQ(1, stopped.cols());
  EXPECT_NEAR(1, std::abs(stopped(0, 0)), 1e-9) << "positions alone";
}

/// Marked while it sticks, with directions that would make it slip, and while it slips.
TEST(FrictionAnalyses, MarksAreFollowed) {
  const SystemPointer block = SwungBlock();
  Matrix directions = Matrix::Zero(7, 4);
  directions(0, 0) = directions(2, 1) = directions(3, 2) = directions(6, 3) = 1;
  BDerivativeOptions options;
  options.variables.inputs = true;
  for (const double mark : {0.1, 0.6, 0.95, 1.3}) {
    for (const double end : {mark + 0.02, mark + 0.4, 2.3}) {
      OnlineFlow flow(block, 0, AtRest(0), Vector::Zero(1), Tight());
      while (flow.AdvanceTo(mark)) continue;
      const Vector x = flow.State();
      RollingDerivative rolling(&flow, directions, options, Tight());
      for (double t = mark; t < end; t = std::min(end, t + 0.07)) {
        while (true) {
          const bool passed = flow.AdvanceTo(std::min(end, t + 0.07));
          rolling.Follow(&flow, passed);
          if (!passed) break;
        }
      }
      const RollingDerivative::Reading reading = rolling.Read(&flow);
      ASSERT_TRUE(reading.status.ok()) << reading.status.message;
      for (int j = 0; j < 4; ++j) {
        const auto outcome = [&](double h) {
          const Vector w = h * directions.col(j);
          return Simulate(*block, x + w.head(6), w.tail(1), end - mark, Tight()).FinalState();
        };
        const bool stuck = j == 2 && std::abs(x(3)) < 1e-12;
        const Vector quotient = (outcome(kStep) - outcome(-kStep)) / (2 * kStep);
        EXPECT_LE((reading.tangents.col(j) - quotient).cwiseAbs().maxCoeff(),
                  stuck ? kOneSided : kCentral)
            << "from " << mark << " to " << end << ", direction " << j;
      }
    }
  }
}

/// Stops at x = v₀² / (2 g (μ cos φ − sin φ)): thrown to stop at 1 m.
TEST(FrictionAnalyses, AThrowIsFoundThatStopsWhereItShould) {
  const auto block = MakeModel("block_on_incline", {{"incline", 0.2}, {"friction", 0.6}});
  OutcomeProblem problem;
  problem.x = AtRest(0);
  problem.x(3) = 1;
  problem.u = problem.effort = Vector::Zero(1);
  problem.duration = 3;
  problem.unknowns = {{OutcomeUnknown::Kind::kVelocity, 0}};
  problem.target = problem.weight = Vector::Zero(6);
  problem.target(0) = problem.weight(0) = 1;
  const DescentResult found =
      Minimize(MakeOutcomeCost(*block, problem), UnknownValues(*block, problem));
  ASSERT_EQ(DescentStatus::kMinimum, found.status) << found.message;
  const double slowing = 9.81 * (0.6 * std::cos(0.2) - std::sin(0.2));
  EXPECT_NEAR(std::sqrt(2 * slowing), found.y(0), 1e-6);
}

/// A block on a spring, swung over its cone: it sticks and slips once in each half period.
TEST(FrictionAnalyses, StickSlipOscillationIsFoundAndStable) {
  const ParameterValues values = {
      {"incline", 0}, {"amplitude", 6}, {"frequency", 3}, {"stiffness", 2}, {"friction", 0.4}};
  const SystemPointer block = MakeModel("block_on_incline", values);
  const double period = 2 * M_PI / 3;
  OrbitProblem problem;
  problem.factory = [](const ParameterValues& p) { return MakeModel("block_on_incline", p); };
  problem.parameters = values;
  problem.section = Section::After(period);
  problem.section.symmetry.Shift(*block, "clock", -period);
  problem.x = Simulate(*block, AtRest(0.5), Vector::Zero(1), 2 * period, Tight()).FinalState();
  problem.x(2) = 0.5;
  problem.x(0) += 0.02;
  problem.u = Vector::Zero(1);
  problem.conditions = {{OrbitCondition::Kind::kCoordinate, 2, 0.5}};  // of a family, by phase
  const OrbitSolution orbit = FindOrbit(problem);
  ASSERT_TRUE(orbit.ok()) << orbit.newton.message;
  EXPECT_GE(orbit.orbit.trajectory.transitions.size(), 2u);
  std::string words = LettersOf(orbit.orbit.trajectory);
  EXPECT_NE(std::string::npos, words.find('+')) << words;
  EXPECT_NE(std::string::npos, words.find('-')) << words;
  // Where the clock is not disturbed, which is invariant.
  Matrix plane = Matrix::Zero(6, 2);
  plane(0, 0) = plane(3, 1) = 1;
  const ReducedMap reduced = RestrictToInvariant(orbit.orbit.map, plane);
  EXPECT_LE(reduced.residual, 1e-9);
  const StabilityReport report = AssessStability(reduced.map);
  EXPECT_EQ(StabilityVerdict::kStable, report.verdict) << report.message;
  EXPECT_TRUE(VerifyCertificate(reduced.map, report.certificate));
  // Long simulation leads there.
  Vector x = AtRest(0.5);
  for (int k = 0; k < 40; ++k) {
    x = Simulate(*block, x, Vector::Zero(1), period, Tight()).FinalState();
    x(2) = 0.5;
  }
  EXPECT_LE((x - orbit.x).cwiseAbs().maxCoeff(), 1e-8) << words;
}

/// A block let go on a slope beyond its friction: along its slip as runs say, against it κ times as
/// much, (sin φ − μ cos φ) / (sin φ + μ cos φ), and turned back.
TEST(FrictionAnalyses, SlipThatBeginsIsTurnedBack) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const SystemPointer block = MakeModel("block_on_incline", {{"incline", 0.5}, {"friction", 0.3}});
  const Vector x = AtRest(0), u = Vector::Zero(1);
  const Trajectory run = Simulate(*block, x, u, 0.5, Tight());
  EXPECT_EQ("+", LettersOf(run));
  const BDerivative B = DifferentiateOutcome(*block, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Vector w = Vector::Unit(6, 3);
  EXPECT_NEAR(1, B(w)(3), 1e-9);
  const double h = 1e-3;
  const Vector against = Simulate(*block, x - h * w, u, 0.5, Tight()).FinalState();
  const double kappa =
      (std::sin(0.5) - 0.3 * std::cos(0.5)) / (std::sin(0.5) + 0.3 * std::cos(0.5));
  EXPECT_NEAR(-kappa, ((against - run.FinalState()) / h)(3), 1e-9);
  EXPECT_NEAR(-kappa, B(-w)(3), 1e-9);
  EXPECT_EQ(2u, B.Pieces().pieces().size());
  EXPECT_NO_THROW(B(-Vector::Unit(6, 0)));
  // Begun by an input: of two maps one is given, and said to be one.
  const InputSchedule inputs{{0, 0.1}, {Vector::Constant(1, -3), u}};
  const Trajectory pushed = Simulate(*block, x, inputs, 0.5, Tight());
  EXPECT_EQ("s+", LettersOf(pushed));
  const std::vector<IntervalLinearization> intervals = Linearize(*block, pushed);
  ASSERT_EQ(2u, intervals.size());
  EXPECT_TRUE(intervals[0].is_linear);
  EXPECT_TRUE(intervals[1].status.ok()) << intervals[1].status.message;
  EXPECT_FALSE(intervals[1].is_linear);
}

/// Two feet that land at once and feel each other: each order leads where the runs lead in which
/// one foot lands 1e-9 m earlier, which moves them by some 1e-9.
TEST(FrictionAnalyses, OrdersAreContinuedToWhereRunsBesideLead) {
  const test::FrictionCase c("order_together");
  const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(*c.system, run);
  ASSERT_EQ(Outcome::kDiscontinuous, B.status.outcome) << B.status.message;
  const EventMap& event = B.events.back();
  ASSERT_EQ(2u, event.outcomes().size());
  const std::vector<ContinuedOutcome> ends =
      ContinueOutcomes(*c.system, InputSchedule::Constant(c.u),
                       run.transitions[B.events.size() - 1], event.outcomes(), c.duration, Tight());
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_TRUE(ends[k].status.ok()) << ends[k].status.message;
    Vector x = c.x;
    x(1 + 2 * event.outcomes()[k].order.front()) -= 1e-9;  // z of that foot
    SimulateOptions options = Tight();
    options.simultaneity_tolerance = 1e-13;
    const Trajectory beside = Simulate(*c.system, x, c.u, c.duration, options);
    ASSERT_TRUE(beside.status.ok()) << beside.status.message;
    EXPECT_LE((beside.FinalState() - ends[k].final_state).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_EQ(ends[k].modes.back(), beside.arcs.back().mode);
    EXPECT_EQ(ends[k].modes.front(), event.outcomes()[k].mode_after);
    EXPECT_EQ(c.system->num_rows(), event.outcomes()[k].impulse.size());
    EXPECT_GT(event.outcomes()[k].impulse.norm(), 0);
  }
  EXPECT_GT((ends[0].final_state - ends[1].final_state).norm(), 1e-3);
}

/// Runs from samples of a normal start beside the moments of B(w): where a bounce is on the border
/// between slip and stick, which makes two pieces.
TEST(FrictionAnalyses, CovarianceThroughABounceOnTheBorderOfSlip) {
  const test::FrictionCase c("border_bounce");
  const MechanicalSystem& system = *c.system;
  const Trajectory run = Simulate(system, c.x, c.u, c.duration, Tight());
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const PiecewiseLinearMap map = B.Pieces();
  ASSERT_EQ(2u, map.pieces().size());
  constexpr double kDeviation = 1e-4;
  const int n = 2 * system.dof();
  const Matrix P = kDeviation * kDeviation * Matrix::Identity(n, n);
  const OutcomeCovariance moments = PropagateCovariance(map, P);
  EXPECT_EQ(CovarianceMethod::kTruncation, moments.method);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  constexpr int kRuns = 20000;
  Vector mean = Vector::Zero(n);
  Matrix second = Matrix::Zero(n, n);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-10;
  for (int k = 0; k < kRuns; ++k) {
    Vector w(n);
    for (double& entry : w) entry = kDeviation * normal(random);
    const Vector change =
        Simulate(system, c.x + w, c.u, c.duration, options).FinalState() - run.FinalState();
    mean += change / kRuns;
    second += change * change.transpose() / kRuns;
  }
  const Matrix covariance = second - mean * mean.transpose();
  const double size = moments.covariance.cwiseAbs().maxCoeff();
  // Five standard errors, √(2/20000) of a variance, √(1/20000) of a deviation; second order of the
  // flow is 1e-4 of that.
  EXPECT_LE((covariance - moments.covariance).cwiseAbs().maxCoeff(), 0.05 * size);
  EXPECT_LE((mean - moments.mean).cwiseAbs().maxCoeff(), 0.036 * std::sqrt(size));
  EXPECT_GT(moments.mean.cwiseAbs().maxCoeff(), 0.05 * kDeviation) << "a kink rectifies";
}

}  // namespace
}  // namespace contact_flow
