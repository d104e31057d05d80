// SPDX-License-Identifier: BSD-3-Clause
// Trajectories through contact: the ball of the hybrid-iLQR literature (arXiv 2103.14584) against
// its closed form.
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "contact_flow/budget.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// ÿ = u − g above a floor.
struct Ball : test::UnitMasses<1, 1> {
  static constexpr const char* kName = "ball";
  static constexpr int kInputs = 1;
  static constexpr std::array<const char*, 1> kCoordinates = {"y"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 1> kInputNames = {"f"};
  template <class P>
  struct Parameters {
    P gravity = 9.8, restitution = 0.7;
    template <class V>
    void Visit(V&& visit) {
      visit(gravity, "gravity", "m/s^2", "downward", Range::kAny);
      visit(restitution, "restitution", "", "of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                    const Eigen::Matrix<S, 1, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = u(0) - p.gravity;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 1, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    *a = q;
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
};

constexpr int kCount = 251;
constexpr double kStep = 0.004, kEffort = 5e-7 / kStep;  // R of each input

/// min Σ R u² + 100 |(y, ẏ)(T) − (1, 0)|² with the only impact at τ, in closed form: position and
/// velocity are affine in u, y(τ) = 0 is one equality, and what is left a linear system.
struct BestWithImpactAt {
  double cost = 0;
  Vector u;
  explicit BestWithImpactAt(double tau) {
    const double end = kCount * kStep, g = 9.8, gamma = 0.7, rest = end - tau;
    Vector fall(kCount), speed(kCount), rise(kCount), later(kCount);
    for (int i = 0; i < kCount; ++i) {
      // ∫ (t − s) u ds and ∫ u ds over the part of interval i before τ, and behind it.
      const double a = i * kStep, b = std::min(a + kStep, tau), c = std::max(a, tau), e = a + kStep;
      const bool before = b > a, behind = e > c;
      speed(i) = before ? b - a : 0;
      fall(i) = before ? ((tau - a) * (tau - a) - (tau - b) * (tau - b)) / 2 : 0;
      later(i) = behind ? e - c : 0;
      rise(i) = behind ? ((end - c) * (end - c) - (end - e) * (end - e)) / 2 : 0;
    }
    Matrix A(2, kCount);
    A.row(0) = -gamma * rest * speed + rise;
    A.row(1) = -gamma * speed + later;
    const Eigen::Vector2d offset(gamma * g * tau * rest - g * rest * rest / 2 - 1,
                                 gamma * g * tau - g * rest);
    Matrix K = Matrix::Zero(kCount + 1, kCount + 1);
    K.topLeftCorner(kCount, kCount) = 200 * A.transpose() * A;
    K.topLeftCorner(kCount, kCount).diagonal().array() += 2 * kEffort;
    K.block(0, kCount, kCount, 1) = fall;
    K.block(kCount, 0, 1, kCount) = fall.transpose();
    Vector right(kCount + 1);
    right << -200 * A.transpose() * offset, g * tau * tau / 2 - 4;
    u = K.partialPivLu().solve(right).head(kCount);
    cost = kEffort * u.squaredNorm() + 100 * (A * u + offset).squaredNorm();
  }
};

class BallProblem : public testing::Test {
 protected:
  BallProblem() : system(ParameterValues{}) {
    problem.x = Eigen::Vector2d(4, 0);
    for (int k = 0; k < kCount; ++k) {
      problem.inputs.grid.push_back(k * kStep);
      problem.inputs.values.push_back(Vector::Zero(1));
    }
    problem.duration = kCount * kStep;
    problem.effort = Vector::Constant(1, kEffort / kStep);
    problem.weight = Vector::Constant(2, 100);
    problem.target = Eigen::Vector2d(1, 0);
  }

  void Begin(double u) {
    for (Vector& value : problem.inputs.values) value.setConstant(u);
  }

  const ModelSystem<Ball> system;
  TrajectoryProblem problem;
};

/// With the impact on change k of the input, for k = 167 … 177, the least cost is a valley: a
/// search from there stays, and its certificate has the slopes of the closed form.
TEST_F(BallProblem, ValleysAreThoseOfTheClosedForm) {
  for (int k = 167; k <= 177; ++k) {
    const double tau = k * kStep;
    const BestWithImpactAt best(tau);
    for (int i = 0; i < kCount; ++i) problem.inputs.values[i](0) = best.u(i);
    const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
    ASSERT_EQ(TrajectoryVerdict::kValley, optimum.verdict) << k << ": " << optimum.message;
    // Instants are known to 1e-14 s, and slopes are below 50 /s.
    EXPECT_NEAR(best.cost, optimum.cost, 1e-10) << k;
    EXPECT_LE(optimum.iterations.size(), 3u) << k;
    ASSERT_EQ(2u, optimum.certificate.size());
    EXPECT_LT(optimum.hull_distance, 1e-9) << k;
    for (const PieceProof& piece : optimum.certificate) {
      ASSERT_EQ(1u, piece.slopes.size()) << k;
      const double sign = piece.label == "floor, input change" ? -1 : 1;
      // One-sided and extrapolated: an error of order e² and 1e-12/e of rounding, below 1e-5.
      constexpr double e = 1e-6;
      const double slope = (4 * BestWithImpactAt(tau + sign * e).cost -
                            BestWithImpactAt(tau + 2 * sign * e).cost - 3 * best.cost) /
                           (2 * e);
      EXPECT_NEAR(slope, piece.slopes.front().slope, 1e-4 * (1 + slope)) << k << piece.label;
      EXPECT_LT(piece.residual, 1e-9);
    }
  }
}

/// The figures of the literature's problem: costs and slopes.
TEST_F(BallProblem, ClosedFormHasTheKnownCosts) {
  EXPECT_NEAR(2.147809, BestWithImpactAt(174 * kStep).cost, 1e-6);
  EXPECT_NEAR(2.142216895, BestWithImpactAt(175 * kStep).cost, 1e-9);
  EXPECT_NEAR(2.156083, BestWithImpactAt(177 * kStep).cost, 1e-6);
  const struct {
    int k;
    double before, after;
  } known[] = {{174, 11.275, 6.562}, {175, 8.520, 7.826}, {177, 2.782, 10.712}};
  for (const auto& valley : known) {
    const BestWithImpactAt best(valley.k * kStep);
    for (int i = 0; i < kCount; ++i) problem.inputs.values[i](0) = best.u(i);
    const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
    ASSERT_EQ(2u, optimum.certificate.size());
    for (const PieceProof& piece : optimum.certificate) {
      const double slope = piece.label == "floor, input change" ? valley.before : valley.after;
      EXPECT_NEAR(slope, piece.slopes.front().slope, 1e-3) << valley.k;
    }
  }
}

TEST_F(BallProblem, PlainDescentStopsInAValleyAndNeighboursFindTheLowest) {
  const double lowest = BestWithImpactAt(175 * kStep).cost;
  for (double u : {-100.0, -20.0, 0.0}) {
    Begin(u);
    const TrajectoryOptimum plain = OptimizeTrajectory(system, problem);
    EXPECT_EQ(TrajectoryVerdict::kValley, plain.verdict) << plain.message;
    EXPECT_EQ(1, plain.valleys);
    EXPECT_LT(plain.hull_distance, 1e-9);
    TrajectoryOptions options;
    options.neighbours = true;
    const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem, options);
    std::printf("u = %g: %s: %.10f, with neighbours %.10f, %d valleys, %ld runs, %ld derivatives\n",
                u, VerdictName(plain.verdict), plain.cost, optimum.cost, optimum.valleys,
                optimum.simulations, optimum.derivatives);
    EXPECT_EQ(TrajectoryVerdict::kValley, optimum.verdict) << optimum.message;
    EXPECT_NEAR(lowest, optimum.cost, 1e-9) << u;
    EXPECT_LE(optimum.cost, plain.cost);
    ASSERT_EQ(2u, optimum.certificate.size());
    // The cost is that of a plain run of what is returned.
    const Trajectory run =
        Simulate(system, optimum.x, optimum.inputs, problem.duration, problem.simulate);
    ASSERT_TRUE(run.status.ok());
    double cost = 100 * (run.FinalState() - problem.target).squaredNorm();
    for (const Vector& value : optimum.inputs.values) cost += kEffort * value.squaredNorm();
    EXPECT_NEAR(optimum.cost, cost, 1e-12);
    for (std::size_t i = 1; i < optimum.iterations.size(); ++i) {
      EXPECT_LE(optimum.iterations[i].best, optimum.iterations[i - 1].best);
    }
  }
}

/// A ball that does not reach the floor: linear dynamics and a quadratic cost, one step.
TEST_F(BallProblem, WithoutContactItIsALinearSystem) {
  problem.x(0) = 40;
  problem.target(0) = 38;
  const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, optimum.verdict) << optimum.message;
  EXPECT_LE(optimum.iterations.size(), 3u);
  ASSERT_EQ(1u, optimum.certificate.size());
  EXPECT_LT(optimum.certificate.front().residual, 1e-8);
}

/// Without effort most directions are free: the second order is singular.
TEST_F(BallProblem, WithoutEffortTheTargetIsMet) {
  problem.effort.setZero();
  Begin(-20);
  const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
  EXPECT_LT(optimum.cost, 1e-12) << optimum.message;
  EXPECT_LE(static_cast<int>(optimum.verdict), static_cast<int>(TrajectoryVerdict::kValley))
      << optimum.message;
}

/// Bounds, some of which hold.
TEST_F(BallProblem, InputsStayInTheirBox) {
  problem.x(0) = 40;
  problem.target(0) = 38;
  problem.lower = Vector::Constant(1, -5);
  problem.upper = Vector::Constant(1, 16);
  const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, optimum.verdict) << optimum.message;
  int at_bound = 0;
  for (const Vector& value : optimum.inputs.values) {
    EXPECT_GE(value(0), -5);
    EXPECT_LE(value(0), 16);
    at_bound += value(0) == -5 || value(0) == 16;
  }
  EXPECT_GT(at_bound, 0);
  // No admitted change of a single input makes it cheaper (a convex problem).
  for (int i = 0; i < kCount; i += 25) {
    for (double change : {1e-3, -1e-3}) {
      InputSchedule other = optimum.inputs;
      other.values[i](0) = std::min(16.0, std::max(-5.0, other.values[i](0) + change));
      const Trajectory run = Simulate(system, optimum.x, other, problem.duration, problem.simulate);
      double cost = 100 * (run.FinalState() - problem.target).squaredNorm();
      for (const Vector& value : other.values) cost += kEffort * value.squaredNorm();
      EXPECT_GE(cost, optimum.cost - 1e-11) << i;
    }
  }
}

/// The initial state as an unknown: thrown so that it needs no input.
TEST_F(BallProblem, InitialVelocityMayBeChosen) {
  problem.choose_inputs = false;
  problem.choose_initial = {1};
  problem.weight = Eigen::Vector2d(1, 0);
  const TrajectoryOptimum optimum = OptimizeTrajectory(system, problem);
  EXPECT_EQ(TrajectoryVerdict::kSmoothMinimum, optimum.verdict) << optimum.message;
  EXPECT_LT(optimum.cost, 1e-9);
  EXPECT_EQ(1, optimum.y.size());
}

/// Positions on the way: g of each piece against quotients of plain runs, on a kink and off it.
TEST_F(BallProblem, GradientsWithCostsOnTheWayAreThoseOfRuns) {
  problem.path_weight = Vector::Constant(1, 3);
  problem.path_target = Vector::Constant(1, 0.5);
  const BestWithImpactAt best(170 * kStep);
  const Unknowns unknowns(system, problem);
  for (double shift : {0.0, 0.01}) {
    const Vector y = best.u.array() + shift;
    const PieceModels models = MakePieceModels(unknowns, y);
    ASSERT_TRUE(models.status.ok()) << models.status.message;
    ASSERT_EQ(shift == 0 ? 2u : 1u, models.pieces.size());
    for (const PieceModel& piece : models.pieces) {
      // Into the piece: along its order row.
      Vector d = Vector::LinSpaced(kCount, -1, 1);
      if (shift == 0) {
        const OrderRow* face = nullptr;
        for (const OrderRow& row : piece.orders) {
          if (std::abs(row.slack) < 1e-6) face = &row;
        }
        ASSERT_NE(nullptr, face);
        if (face->row.dot(d) < 0) d = -d;
      }
      const auto cost = [&](double alpha) {
        const Vector at = y + alpha * d;
        const Trajectory run = unknowns.Run(at, 1e-12, false);
        return unknowns.Cost(at, unknowns.States(run));
      };
      // The one-sided quotient, extrapolated: O(α²), and 1e-11/α of rounding.
      constexpr double a = 1e-4;
      const double slope = (4 * cost(a) - cost(2 * a) - 3 * cost(0)) / (2 * a);
      EXPECT_NEAR(slope, piece.gradient.dot(d), 1e-4 * (1 + std::abs(slope))) << piece.label;
    }
  }
}

TEST_F(BallProblem, CallerAndBudgetEndTheSearch) {
  TrajectoryOptions options;
  int calls = 0;
  options.progress = [&calls](const TrajectoryIteration& at, const Vector& y) {
    EXPECT_EQ(kCount, y.size());
    EXPECT_LE(at.best, at.cost);
    return ++calls < 3;
  };
  const TrajectoryOptimum stopped = OptimizeTrajectory(system, problem, options);
  EXPECT_EQ(TrajectoryVerdict::kCancelled, stopped.verdict);
  EXPECT_EQ(3u, stopped.iterations.size());
  EXPECT_TRUE(std::isfinite(stopped.cost));
  // Wherever it ends: in a run, in a derivative, in a step.
  Begin(-100);
  for (double seconds : {1e-4, 1e-3, 4e-3, 0.01, 0.02, 0.03, 0.05, 0.08}) {
    BudgetLimits limits;
    limits.max_seconds = seconds;
    const Budget budget(limits);
    const BudgetScope scope(budget);
    const TrajectoryOptimum late = OptimizeTrajectory(system, problem);
    EXPECT_EQ(TrajectoryVerdict::kCancelled, late.verdict) << seconds << ": " << late.message;
    EXPECT_LT(budget.elapsed(), 2);
  }
}

TEST_F(BallProblem, MisuseIsRefused) {
  problem.effort = Vector::Constant(2, 1);
  EXPECT_THROW(OptimizeTrajectory(system, problem), std::invalid_argument);
  problem.effort = Vector::Constant(1, -1);
  EXPECT_THROW(OptimizeTrajectory(system, problem), std::invalid_argument);
  problem.effort = Vector::Constant(1, 1);
  problem.duration = 1;  // = the last instant
  EXPECT_THROW(OptimizeTrajectory(system, problem), std::invalid_argument);
  problem.duration = 1.1;
  problem.choose_inputs = false;
  EXPECT_THROW(OptimizeTrajectory(system, problem), std::invalid_argument);
  problem.choose_initial = {5};
  EXPECT_THROW(OptimizeTrajectory(system, problem), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
