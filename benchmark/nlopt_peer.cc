// SPDX-License-Identifier: BSD-3-Clause
#include <nlopt.h>

#include <chrono>
#include <cmath>
#include <string>
#include <vector>

#include "ball_problem.h"

namespace contact_flow {
namespace benchmark {
namespace {

/// Gradients by differences at most, each of 252 runs.
constexpr int kMaxDifferences = 100;

struct Objective {
  const BallProblem* ball;
  const Unknowns* unknowns;
  bool differences;
  PeerOptimum* result;

  double Cost(const Vector& y) const {
    ++result->simulations;
    const Trajectory run = unknowns->Run(y, 1e-12, false);
    return run.status.ok() ? unknowns->Cost(y, unknowns->States(run)) : HUGE_VAL;
  }

  double operator()(const Vector& y, double* gradient) const {
    const double cost = Cost(y);
    if (gradient == nullptr) return cost;
    if (!differences) {
      ++result->derivatives;
      const PieceModels models = MakePieceModels(*unknowns, y);
      for (Eigen::Index i = 0; i < y.size(); ++i) {
        gradient[i] = models.pieces.empty() ? 0 : models.pieces.front().gradient(i);
      }
      return cost;
    }
    for (Eigen::Index i = 0; i < y.size(); ++i) {
      constexpr double kStep = 1e-5;
      Vector moved = y;
      moved(i) += kStep;
      gradient[i] = (Cost(moved) - cost) / kStep;
    }
    return cost;
  }
};

double Call(unsigned n, const double* y, double* gradient, void* objective) {
  const Eigen::Map<const Vector> at(y, n);
  return (*static_cast<const Objective*>(objective))(at, gradient);
}

}  // namespace

PeerOptimum RunNlopt(const BallProblem& ball, bool differences, double enough) {
  const auto start = std::chrono::steady_clock::now();
  PeerOptimum result;
  const Unknowns unknowns(*ball.system, ball.problem);
  const Objective objective{&ball, &unknowns, differences, &result};
  const auto n = static_cast<unsigned>(unknowns.size());
  nlopt_opt search = nlopt_create(NLOPT_LD_LBFGS, n);
  nlopt_set_min_objective(search, Call, const_cast<Objective*>(&objective));
  nlopt_set_ftol_rel(search, 1e-12);
  nlopt_set_maxeval(search, differences ? kMaxDifferences : 1000);
  nlopt_set_stopval(search, enough);
  Vector y = unknowns.Start();
  const nlopt_result end = nlopt_optimize(search, y.data(), &result.cost);
  result.message = nlopt_result_to_string(end);
  nlopt_destroy(search);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  result.seconds = seconds.count();
  return result;
}

}  // namespace benchmark
}  // namespace contact_flow
