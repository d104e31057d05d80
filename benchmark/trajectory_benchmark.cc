// SPDX-License-Identifier: BSD-3-Clause
// The ball of the hybrid-iLQR literature from three starts: this package beside methods that do not
// know of pieces, and beside finite differences at equal cost. Arguments: other starts.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <vector>

#include "ball_problem.h"

namespace contact_flow {
namespace benchmark {
namespace {

/// A run with its derivative counts as this many plain ones, more than it takes.
constexpr long kRunsOfDerivative = 5;
constexpr double kLowest = 2.142216895;
constexpr long kAtLeast = 20;

long Work(const PeerOptimum& peer) {
  return peer.simulations + kRunsOfDerivative * peer.derivatives;
}

void Print(const char* name, double start, const PeerOptimum& peer) {
  if (peer.message.empty()) {
    std::printf("%-34s %6g  not built in\n", name, start);
    return;
  }
  std::printf("%-34s %6g %14.9g %8ld %6ld %8.2f  %s\n", name, start, peer.cost, peer.simulations,
              peer.derivatives, peer.seconds, peer.message.c_str());
  std::fflush(stdout);
}

/// Ours; it is stopped where the cost `enough` is reached.
PeerOptimum RunOurs(const BallProblem& ball, bool neighbours, double enough) {
  const auto start = std::chrono::steady_clock::now();
  TrajectoryOptions options;
  options.neighbours = neighbours;
  options.progress = [enough](const TrajectoryIteration& at, const Vector&) {
    return at.best > enough;
  };
  const TrajectoryOptimum found = OptimizeTrajectory(*ball.system, ball.problem, options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  return {found.cost, found.simulations, found.derivatives, seconds.count(),
          VerdictName(found.verdict)};
}

}  // namespace

int Main(const std::vector<double>& starts) {
  constexpr double kNever = -std::numeric_limits<double>::infinity();
  std::printf("%-34s %6s %14s %8s %6s %8s\n", "", "start", "cost", "runs", "deriv.", "seconds");
  bool fine = true;
  for (double input : starts) {
    const BallProblem ball(input);
    const PeerOptimum ours = RunOurs(ball, true, kNever);
    Print("pieces, neighbours", input, ours);
    Print("pieces", input, RunOurs(ball, false, kNever));
    Print("hybrid iLQR without pieces", input, RunHybridIlqr(ball));
    Print("NLopt L-BFGS, exact gradient", input, RunNlopt(ball, false, kNever));
    const PeerOptimum differences = RunNlopt(ball, true, kNever);
    Print("NLopt L-BFGS, finite differences", input, differences);
    fine = fine && std::abs(ours.cost - kLowest) < 1e-8;
    if (differences.message.empty()) continue;
    // At equal cost: ours is stopped where it has what the differences ended with.
    const PeerOptimum equal = RunOurs(ball, true, differences.cost);
    const long ratio = differences.simulations / std::max(1L, Work(equal));
    std::printf(
        "  at cost %.6g: %ld runs by differences, %ld by pieces (a derivative as %ld): "
        "%ld times fewer\n",
        differences.cost, differences.simulations, Work(equal), kRunsOfDerivative, ratio);
    fine = fine && ratio >= kAtLeast;
  }
  std::printf("%s\n", fine ? "all as required" : "NOT as required");
  return fine ? 0 : 1;
}

}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  std::vector<double> starts;
  for (int i = 1; i < argc; ++i) starts.push_back(std::atof(argv[i]));
  if (starts.empty()) starts = {-100, -20, 0};
  return contact_flow::benchmark::Main(starts);
}
