// SPDX-License-Identifier: BSD-3-Clause
// What the gradient of a cost takes: the quadruped of config/robots (18 degrees of freedom, 12
// servos) under inputs on a grid of 250 intervals, in plain runs, beside the forward derivative of
// all intervals, and how far they are apart.
//
//   gradient_benchmark [intervals, 250 unless given]
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>

#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "timing.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kLargestRatio = 4;     // of run and gradient together, to a plain run
constexpr double kLargestError = 1e-9;  // relative to the largest entry

InputSchedule Wave(const Vector& u, double duration, int intervals) {
  InputSchedule schedule;
  for (int k = 0; k < intervals; ++k) {
    const double t = duration * k / intervals;
    Vector value = u;
    for (Eigen::Index j = 0; j < u.size(); ++j) {
      value(j) += 0.1 * std::sin(0.3 * static_cast<double>(j) + 6 * t);
    }
    schedule.grid.push_back(t);
    schedule.values.push_back(value);
  }
  return schedule;
}

void Judge(const char* what, double value, double limit) {
  std::printf("  %s  %-46s %9.3g  (at most %.3g)\n", value <= limit ? "holds" : "FAILS", what,
              value, limit);
}

/// The largest difference from the forward derivative, relative to the largest entry.
double Apart(const CostGradient& gradient, const GridDerivative& forward, Vector covector) {
  double size = gradient.initial.cwiseAbs().maxCoeff(), apart = 0;
  for (std::size_t k = forward.intervals().size(); k-- > 0;) {
    const IntervalLinearization& interval = forward.intervals()[k];
    const Vector own = interval.B.transpose() * covector;
    const auto column = gradient.inputs.col(static_cast<Eigen::Index>(k));
    size = std::max(size, own.cwiseAbs().maxCoeff());
    apart = std::max(apart, (own - column).cwiseAbs().maxCoeff());
    covector = interval.A.transpose() * covector;
  }
  return std::max(apart, (covector - gradient.initial).cwiseAbs().maxCoeff()) / size;
}

void Report(const MechanicalSystem& system, double duration, int intervals) {
  const NominalRun& nominal = system.nominal();
  const InputSchedule inputs = Wave(nominal.u, duration, intervals);
  SimulateOptions plain;
  plain.dense = false;
  const Trajectory run = Simulate(system, nominal.x, inputs, duration);
  QuadraticCost terminal, running;
  terminal.weight = running.state_weight = Vector::LinSpaced(system.state_size(), 0.5, 1.5);
  running.weight = terminal.weight;
  running.input_weight = Vector::Ones(system.num_inputs());
  const RunCost at_end = terminal.Make(system), all = running.Make(system);
  BDerivativeOptions options;
  options.variables.inputs = true;
  CostGradient gradient;
  std::unique_ptr<GridDerivative> forward;
  const std::vector<double> seconds =
      TimeInterleaved({[&] { Simulate(system, nominal.x, inputs, duration, plain); },
                       [&] { Simulate(system, nominal.x, inputs, duration); },
                       [&] { gradient = DifferentiateCost(system, run, at_end, options); },
                       [&] { DifferentiateCost(system, run, all, options); },
                       [&] { forward = std::make_unique<GridDerivative>(system, run, options); }},
                      2e-3, 5);
  std::size_t events = 0;
  for (const Transition& transition : run.transitions) events += !transition.changes_input;
  std::printf("%.3g s, %d intervals of %d inputs, %zu events\n", duration, intervals,
              system.num_inputs(), events);
  if (!gradient.status.ok()) {
    std::printf("  no gradient: %s\n", gradient.status.message.c_str());
    return;
  }
  const char* names[] = {"plain run", "run with dense output", "gradient, terminal cost",
                         "gradient, running cost as well", "forward, (A_k, B_k)"};
  for (std::size_t i = 0; i < seconds.size(); ++i) {
    std::printf("  %-34s %9.2f ms %7.2f plain runs\n", names[i], 1e3 * seconds[i],
                seconds[i] / seconds[0]);
  }
  Judge("run and gradient, in plain runs", (seconds[1] + seconds[2]) / seconds[0],
        kLargestRatio + 2 * static_cast<double>(events));
  Judge("gradient, running cost as well", seconds[3] / seconds[0],
        kLargestRatio + 2 * static_cast<double>(events));
  Vector by_state = Vector::Zero(system.state_size());
  at_end.terminal(run.FinalState(), &by_state);
  Judge("apart from forward columns",
        Apart(gradient, *forward, ByTangents(system, run.FinalState(), by_state)), kLargestError);
  std::printf("  law %.1e, %ld Jacobians in %ld steps\n", gradient.law,
              gradient.statistics.jacobians, gradient.statistics.steps);
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  const int intervals = argc > 1 ? std::max(1, std::atoi(argv[1])) : 250;
  const auto robot = contact_flow::LoadRobot(CONTACT_FLOW_QUADRUPED);
  contact_flow::benchmark::Report(*robot, 0.1, intervals);  // in flight
  contact_flow::benchmark::Report(*robot, 0.2, intervals);  // and landing
}
