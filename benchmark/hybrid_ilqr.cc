// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Cholesky>
#include <chrono>
#include <cmath>
#include <vector>

#include "ball_problem.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/trajectory_optimization/extended_reference.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr int kMaxIterations = 300, kMaxHalvings = 30;
constexpr double kEnough = 1e-10;  // promised decrease, relative to 1 + J, as ours

constexpr double kTouches = 1e-9, kRestitution = 0.7;  // [m], of driven_ball

/// Feed-forward and gains of each interval, and what they promise.
struct Gains {
  std::vector<Vector> forward;
  std::vector<Matrix> back;
  double promised = 0;
};

Gains BackwardPass(const BallProblem& ball, const std::vector<IntervalLinearization>& intervals,
                   const InputSchedule& inputs, const Vector& end) {
  const TrajectoryProblem& problem = ball.problem;
  const std::size_t count = intervals.size();
  Gains gains{std::vector<Vector>(count), std::vector<Matrix>(count), 0};
  Vector p = 2 * problem.weight.cwiseProduct(end - problem.target);
  Matrix P = (2 * problem.weight).asDiagonal();
  for (std::size_t k = count; k-- > 0;) {
    const Matrix &A = intervals[k].A, &B = intervals[k].B;
    const double h = intervals[k].t_end - intervals[k].t_begin;
    const Vector r = 2 * h * problem.effort;
    Matrix S = B.transpose() * P * B;
    S.diagonal() += r;
    const Vector q = r.cwiseProduct(inputs.values[k]) + B.transpose() * p;
    const Matrix C = B.transpose() * P * A;
    const Eigen::LLT<Matrix> factor(S);
    gains.forward[k] = -factor.solve(q);
    gains.back[k] = -factor.solve(C);
    gains.promised -= q.dot(gains.forward[k]) / 2;
    p = (A.transpose() * p + C.transpose() * gains.forward[k]).eval();
    P = (A.transpose() * P * A + C.transpose() * gains.back[k]).eval();
    P = (0.5 * (P + P.transpose())).eval();
  }
  return gains;
}

/// u = ū + α k + K (x − x̄), x̄ of the phase that the run is in.
InputSchedule ForwardPass(const BallProblem& ball, const ExtendedReference& reference,
                          const Gains& gains, double alpha, bool* fine) {
  InputSchedule inputs = reference.inputs();
  Vector x = ball.problem.x;
  int phase = 0;
  const int last = static_cast<int>(reference.phases().size()) - 1;
  *fine = true;
  for (std::size_t k = 0; k < inputs.grid.size() && *fine; ++k) {
    const double t = inputs.grid[k];
    const double end = k + 1 < inputs.grid.size() ? inputs.grid[k + 1] : ball.problem.duration;
    const Vector error = x - reference.State(std::min(phase, last), t);
    inputs.values[k] += alpha * gains.forward[k] + gains.back[k] * error;
    const Trajectory run =
        Simulate(*ball.system, x, inputs.values[k], end - t, ball.problem.simulate);
    *fine = run.status.ok();
    for (const Transition& event : run.transitions) phase += event.activated.Empty() ? 0 : 1;
    x = run.FinalState();
    if (x(0) <= kTouches && x(1) < 0) {  // at the very end of the interval
      x = Eigen::Vector2d(0, -kRestitution * x(1));
      ++phase;
    }
  }
  return inputs;
}

}  // namespace

PeerOptimum RunHybridIlqr(const BallProblem& ball) {
  const auto start = std::chrono::steady_clock::now();
  PeerOptimum result;
  const Unknowns unknowns(*ball.system, ball.problem);
  InputSchedule inputs = ball.problem.inputs;
  const auto run_with = [&](const InputSchedule& at, bool dense, double* cost) {
    SimulateOptions options = ball.problem.simulate;
    options.dense = dense;
    Trajectory run = Simulate(*ball.system, ball.problem.x, at, ball.problem.duration, options);
    Vector y(unknowns.size());
    for (std::size_t k = 0; k < at.values.size(); ++k) {
      y(unknowns.Input(k, 0)) = at.values[k](0);
    }
    *cost = run.status.ok() ? unknowns.Cost(y, unknowns.States(run)) : HUGE_VAL;
    return run;
  };
  result.message = "max iterations";
  for (int i = 0; i < kMaxIterations; ++i) {
    ++result.derivatives;
    Trajectory run = run_with(inputs, true, &result.cost);
    const std::vector<IntervalLinearization> intervals = Linearize(*ball.system, run);
    const Gains gains = BackwardPass(ball, intervals, inputs, run.FinalState());
    if (gains.promised <= kEnough * (1 + result.cost)) {
      result.message = "promises nothing";
      break;
    }
    const ExtendedReference reference(*ball.system, run, inputs, 0.3);
    bool found = false;
    double alpha = 1;
    for (int halving = 0; halving < kMaxHalvings && !found; ++halving, alpha /= 2) {
      bool fine = true;
      const InputSchedule next = ForwardPass(ball, reference, gains, alpha, &fine);
      ++result.simulations;
      if (!fine) continue;
      double cost = 0;
      run_with(next, false, &cost);  // the same run, of which the cost is taken
      found = result.cost - cost >= 1e-4 * alpha * gains.promised;
      if (found) inputs = next;
    }
    if (!found) {
      result.message = "no step";
      break;
    }
  }
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  result.seconds = seconds.count();
  return result;
}

}  // namespace benchmark
}  // namespace contact_flow
