// SPDX-License-Identifier: BSD-3-Clause
// Multiple shooting: derivatives of segments against quotients, and optima that are those of closed
// forms and of the search by pieces.
#include "contact_flow/trajectory_optimization/multiple_shooting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "src/trajectory_optimization/shooting_segments.h"
#include "test/trajectory_optimization/line_problem_runs.h"

namespace contact_flow {
namespace {

using Kind = TrajectoryCondition::Kind;
using test::LineProblem;

LineProblem ThrownBall(int count, bool linear) {
  LineProblem line;
  line.mass = Vector::Constant(1, 2);
  line.gravity = -9.8;
  line.x = Eigen::Vector2d(1.5, 0);
  line.count = count;
  line.linear = linear;
  line.effort = 0.01;
  line.weight = Eigen::Vector2d(100, 10);
  line.target = Eigen::Vector2d(1, 0);
  return line;
}

TEST(MultipleShooting, WithoutIpoptItIsRefused) {
  if (HaveIpopt()) GTEST_SKIP() << "built with Ipopt";
  const auto ball = MakeModel("driven_ball", {{"mass", 2}});
  try {
    OptimizeByShooting(*ball, test::BallOf(ThrownBall(4, false), 0));
    FAIL();
  } catch (const std::runtime_error& reason) {
    EXPECT_NE(std::string::npos, std::string(reason.what()).find("coinor-libipopt-dev"));
  }
}

/// Free flight to a goal that costs 10⁸: Ipopt converges beside such gradients before efforts count
/// for anything.
TEST(MultipleShooting, IsNoMinimumWherePiecesPromiseMore) {
  if (!HaveIpopt()) GTEST_SKIP() << "built without Ipopt";
  const auto ball = MakeModel("driven_ball");
  TrajectoryProblem problem;
  problem.x = Eigen::Vector2d(4, 0);
  problem.duration = 0.8;
  for (const double t : {0.0, 0.2, 0.35, 0.6}) {
    problem.inputs.grid.push_back(t);
    problem.inputs.values.push_back(Vector::Zero(1));
  }
  problem.linear_inputs = true;
  problem.effort = Vector::Constant(1, 0.01);
  problem.target = Eigen::Vector2d(3, 1);
  for (const double weight : {1.0, 1e4, 1e8, 1e10}) {
    problem.weight = Vector::Constant(2, weight);
    const double least = OptimizeTrajectory(*ball, problem).cost;
    const TrajectoryOptimum found = OptimizeByShooting(*ball, problem);
    if (found.verdict == TrajectoryVerdict::kSmoothMinimum) {
      EXPECT_NEAR(least, found.cost, 1e-7) << weight;
    } else {
      EXPECT_NE(std::string::npos, found.message.find("pieces promise")) << found.message;
      EXPECT_GT(weight, 1e4);
    }
  }
}

/// The rows and J by inputs and states, through an impact, against extrapolated quotients.
TEST(MultipleShooting, SegmentsHaveTheSlopesOfTheirRuns) {
  const auto ball = MakeModel("driven_ball", {{"mass", 2}, {"restitution", 0.8}});
  for (const bool linear : {false, true}) {
    TrajectoryProblem problem = test::BallOf(ThrownBall(6, linear), 1);
    problem.path_weight = Vector::Constant(1, 0.7);
    problem.path_target = Vector::Constant(1, 0.3);
    problem.power = {{0, 0, 0.1}};
    problem.choose_initial = {1};
    problem.conditions = {{Kind::kState, 0, 2, 0.1, 5}, {Kind::kState, 1, 6, -1, 1}};
    ShootingOptions shooting;
    shooting.segments = {1, 2, 5};
    ShootingSegments segments(*ball, problem, shooting, 720);
    ASSERT_EQ(4u, segments.size());
    ASSERT_EQ((linear ? 7 : 6) + 1 + 3 * 2, segments.count());
    ASSERT_EQ(2 + 3 * 2, segments.rows());
    Vector z = Vector::LinSpaced(segments.count(), -0.02, 0.03);
    z.head(segments.whole().size()) += segments.whole().Start();
    double f;
    Vector rows, gradient, entries;
    ASSERT_TRUE(segments.Evaluate(z, &f, &rows));
    ASSERT_TRUE(segments.Differentiate(z, &gradient, &entries)) << segments.reason();
    const auto pattern = segments.Pattern();
    ASSERT_EQ(static_cast<Eigen::Index>(pattern.size()), entries.size());
    Matrix jacobian = Matrix::Zero(segments.rows(), segments.count());
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      EXPECT_EQ(0, jacobian(pattern[i].first, pattern[i].second));
      jacobian(pattern[i].first, pattern[i].second) = entries(static_cast<Eigen::Index>(i));
    }
    for (int i = 0; i < segments.count(); ++i) {
      constexpr double a = 1e-4;
      const auto quotient = [&](double step) {
        double above, below;
        Vector up, down;
        EXPECT_TRUE(segments.Evaluate(z + step * Vector::Unit(z.size(), i), &above, &up));
        EXPECT_TRUE(segments.Evaluate(z - step * Vector::Unit(z.size(), i), &below, &down));
        Vector all(1 + up.size());
        all << above - below, up - down;
        return Vector(all / (2 * step));
      };
      const Vector slopes = (4 * quotient(a) - quotient(2 * a)) / 3;
      EXPECT_NEAR(slopes(0), gradient(i), 1e-6 * (1 + std::abs(slopes(0)))) << i;
      for (int r = 0; r < segments.rows(); ++r) {
        EXPECT_NEAR(slopes(1 + r), jacobian(r, i), 1e-6 * (1 + std::abs(slopes(1 + r))))
            << "row " << r << ", unknown " << i;
      }
    }
  }
}

/// With inputs that are led the cost has no kinks: the least is that of the closed form.
TEST(MultipleShooting, FindsTheOptimumOfTheClosedForm) {
  if (!HaveIpopt()) GTEST_SKIP() << "built without Ipopt";
  for (const double e : {1.0, 0.7}) {
    const auto ball = MakeModel("driven_ball", {{"mass", 2}, {"restitution", e}});
    const LineProblem line = ThrownBall(8, true);
    const double best = line.Best({Vector::Ones(1), 0, e}, 0.05, 0.95);
    const TrajectoryProblem problem = test::BallOf(line, 0);
    const TrajectoryOptimum found = OptimizeByShooting(*ball, problem);
    std::printf("%s; closed form %.10g; %ld runs of segments, %ld derivatives\n",
                found.message.c_str(), best, found.simulations, found.derivatives);
    EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
    EXPECT_NEAR(best, found.cost, 1e-8 * (1 + best));
    EXPECT_NEAR(OptimizeTrajectory(*ball, problem).cost, found.cost, 1e-8 * (1 + best));
    EXPECT_EQ(1, found.input_end.size());
  }
}

/// Equalities at the end and bounds on the way, against the search by pieces: multipliers, too.
TEST(MultipleShooting, HoldsConditionsAsTheSearchByPieces) {
  if (!HaveIpopt()) GTEST_SKIP() << "built without Ipopt";
  const auto ball = MakeModel("driven_ball", {{"mass", 2}, {"restitution", 0.8}});
  LineProblem line = ThrownBall(10, true);
  TrajectoryProblem problem = test::BallOf(line, 0);
  problem.weight.setZero();
  problem.conditions = {{Kind::kState, 0, 10, 1, 1},
                        {Kind::kState, 1, 10, 0, 0},
                        {Kind::kState, 0, 2, -10, 1.2},
                        {Kind::kState, 0, 8, -10, 0.85}};
  problem.lower = Vector::Constant(1, -40);
  problem.upper = Vector::Constant(1, 40);
  const TrajectoryOptimum pieces = OptimizeTrajectory(*ball, problem);
  ASSERT_EQ(TrajectoryVerdict::kSmoothMinimum, pieces.verdict) << pieces.message;
  ShootingOptions shooting;
  shooting.segments = {2, 4, 8};
  const TrajectoryOptimum found = OptimizeByShooting(*ball, problem, {}, shooting);
  std::printf("%s\n%s\n", found.message.c_str(), pieces.message.c_str());
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_NEAR(pieces.cost, found.cost, 1e-6 * (1 + pieces.cost));
  ASSERT_EQ(4, found.multipliers.size());
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(pieces.multipliers(i), found.multipliers(i),
                1e-4 * (1 + std::abs(pieces.multipliers(i))))
        << i;
  }
  EXPECT_LT(Violations(problem.conditions, found.condition_values).maxCoeff(), 1e-7);
}

/// From states that no run joins: the ball is already up when the second segment begins.
TEST(MultipleShooting, BeginsWithStatesThatNoRunJoins) {
  if (!HaveIpopt()) GTEST_SKIP() << "built without Ipopt";
  const auto ball = MakeModel("driven_ball", {{"mass", 2}, {"restitution", 1}});
  const LineProblem line = ThrownBall(8, true);
  ShootingOptions shooting;
  shooting.segments = {2, 6};
  shooting.states = Matrix(2, 2);
  shooting.states << 1.2, 0.7, -2, 2;
  const TrajectoryOptimum found = OptimizeByShooting(*ball, test::BallOf(line, 0), {}, shooting);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, found.verdict) << found.message;
  EXPECT_NEAR(line.Best({Vector::Ones(1), 0, 1}, 0.05, 0.95), found.cost, 1e-8);
  EXPECT_LT(found.cost, found.iterations.front().cost);
}

TEST(MultipleShooting, EndsAndMisuse) {
  const auto ball = MakeModel("driven_ball", {{"mass", 2}});
  const TrajectoryProblem good = test::BallOf(ThrownBall(8, false), 0);
  const auto refusal = [&](const TrajectoryProblem& problem, const ShootingOptions& shooting) {
    try {
      const ShootingSegments segments(*ball, problem, shooting, 720);
    } catch (const std::invalid_argument& reason) {
      return std::string(reason.what());
    }
    return std::string();
  };
  EXPECT_EQ("", refusal(good, {}));
  ShootingOptions shooting;
  for (const std::vector<int>& wrong : {std::vector<int>{0}, {8}, {3, 3}, {5, 2}, {-1}}) {
    shooting.segments = wrong;
    EXPECT_NE(std::string::npos, refusal(good, shooting).find("segments has"));
  }
  shooting.segments = {2};
  shooting.states = Matrix::Zero(2, 2);
  EXPECT_NE(std::string::npos, refusal(good, shooting).find("states"));
  shooting.states = Matrix::Zero(2, 1);  // on the floor, at rest
  EXPECT_NE(std::string::npos, refusal(good, shooting).find("from instant 2"));
  TrajectoryProblem problem = good;
  problem.choose_inputs = false;
  problem.choose_initial = {1};
  EXPECT_NE(std::string::npos, refusal(problem, {}).find("inputs are to be chosen"));
  problem = good;
  problem.choose_durations = {1};
  EXPECT_NE(std::string::npos, refusal(problem, {}).find("lengths of intervals"));
  problem = good;
  problem.conditions = {{Kind::kTouchdown, 0, 0, 0.3, 0.3}};
  EXPECT_NE(std::string::npos, refusal(problem, {}).find("touchdown"));
  if (!HaveIpopt()) return;
  TrajectoryOptions options;
  options.progress = [](const TrajectoryIteration& at, const Vector&) { return at.iteration < 2; };
  EXPECT_EQ(TrajectoryVerdict::kCancelled, OptimizeByShooting(*ball, good, options).verdict);
  options.progress = nullptr;
  options.max_iterations = 1;
  EXPECT_EQ(TrajectoryVerdict::kMaxIterations, OptimizeByShooting(*ball, good, options).verdict);
  problem = good;
  problem.conditions = {{Kind::kState, 0, 8, 1, 1}, {Kind::kState, 0, 8, 2, 2}};
  EXPECT_NE(TrajectoryVerdict::kSmoothMinimum, OptimizeByShooting(*ball, problem).verdict);
  // Two segments, each of which ends before the bounces accumulate that one run through both meets.
  LineProblem low = ThrownBall(8, false);
  low.x(0) = 0.05;
  shooting.segments = {4};
  shooting.states = Eigen::Vector2d(1, 0);
  options.max_iterations = 0;
  const TrajectoryOptimum none = OptimizeByShooting(*ball, test::BallOf(low, 0), options, shooting);
  EXPECT_NE(std::string::npos, none.message.find("ends early")) << none.message;
  EXPECT_TRUE(std::isinf(none.cost)) << "of a run that ends early there is no cost";
}

}  // namespace
}  // namespace contact_flow
