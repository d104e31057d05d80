// SPDX-License-Identifier: BSD-3-Clause
// How cost grows with contacts, degrees of freedom and variables.
//
//   scaling_benchmark [largest n, 64 unless given]     prints the tables
//   scaling_benchmark --loop rhs|run|direction n N     does one thing N times, for a profiler
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cost_gradient.h"
#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "test/model/growing_robots.h"
#include "timing.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kLargestRatio = 2;                             // of a right-hand side in a run
constexpr double kDirectionAt32 = 1e-3, kDirectionAt64 = 5e-3;  // [s]

/// The transition with most simultaneous activations.
const Transition& LargestCluster(const Trajectory& run) {
  return *std::max_element(run.transitions.begin(), run.transitions.end(),
                           [](const Transition& a, const Transition& b) {
                             return a.activated.Size() < b.activated.Size();
                           });
}

/// Without symmetries: all events of a cluster change places.
Vector Mixture(int size) {
  Vector w(size);
  for (int i = 0; i < size; ++i) w(i) = std::sin(1.0 + i * i);
  return w;
}

struct Table {
  explicit Table(const RobotTexts& texts)
      : system(MakeRobot(texts)), dynamics(*system, system->nominal().u) {}

  Trajectory Run() const {
    const NominalRun& nominal = system->nominal();
    return Simulate(*system, nominal.x, nominal.u, nominal.duration);
  }

  std::unique_ptr<RobotSystem> system;
  ContactDynamics dynamics;
};

struct Costs {
  double n, free, held, in_run, jacobian, direction, next_direction;  // [s]
};

/// The right-hand sides of a run, alone: each arc's mode as often as there.
double RightHandSide(Table* table, const Trajectory& run) {
  double weight = 0, sum = 0;
  for (const Arc& arc : run.arcs) {
    const double steps = static_cast<double>(arc.dense.NumSteps());
    if (steps == 0) continue;
    const double cost =
        TimeInterleaved({[&] { table->dynamics.Evaluate(arc.x_begin, arc.mode); }}, 2e-4, 3)[0];
    weight += steps;
    sum += steps * cost;
  }
  return sum / weight;
}

/// The derivative of the largest cluster along one direction that nothing was computed for before.
double Direction(const Table& table, const Trajectory& run, double* next) {
  const Transition& cluster = LargestCluster(run);
  const auto dynamics = std::make_shared<ContactDynamics>(*table.system, table.dynamics.u());
  const EventMap map(dynamics, cluster);
  if (!map.status().ok()) {
    std::printf("  no derivative: %s\n", map.status().message.c_str());
    return std::nan("");
  }
  const Vector w = Mixture(2 * table.system->dof());
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const EventMap fresh = map;  // it keeps what directions need: each is the first
    least = std::min(least, TimeOnce([&] { fresh(w); }));
    *next = TimeOnce([&] { fresh(w); });
  }
  return least;
}

Costs Measure(int n) {
  Table table(Legs(n));
  const Trajectory run = table.Run();
  const Vector& x = table.system->nominal().x;
  const double rhs = static_cast<double>(run.statistics.field_evaluations);
  const ContactMode all(ConstraintSet::All(n));
  const std::vector<double> seconds = TimeInterleaved(
      {[&] { table.Run(); }, [&] { table.dynamics.Differentiate(x, all); }}, 2e-3, n > 16 ? 3 : 7);
  Costs costs{static_cast<double>(n), 0, 0, seconds[0] / rhs, seconds[1], 0, 0};
  costs.free = TimeInterleaved({[&] { table.dynamics.Evaluate(x, ContactMode()); }})[0];
  costs.held = RightHandSide(&table, run);
  costs.direction = Direction(table, run, &costs.next_direction);
  std::printf("%4d %5d %7zu %8ld %9.2f %9.2f %9.2f %6.2f %10.1f %11.1f %11.1f\n", n,
              table.system->dof(), run.transitions.size(), run.statistics.field_evaluations,
              1e6 * costs.free, 1e6 * costs.held, 1e6 * costs.in_run, costs.in_run / costs.held,
              1e6 * costs.jacobian, 1e6 * costs.direction, 1e6 * costs.next_direction);
  std::fflush(stdout);
  return costs;
}

/// The exponent p of cost ∝ nᵖ from one row to the next.
void PrintGrowth(const std::vector<Costs>& rows) {
  std::printf("growth exponents, from row to row\n");
  for (std::size_t k = 1; k < rows.size(); ++k) {
    const double octave = std::log(rows[k].n / rows[k - 1].n);
    const auto exponent = [&](double Costs::*cost) {
      return std::log(rows[k].*cost / rows[k - 1].*cost) / octave;
    };
    std::printf("%4.0f %23s %9.2f %9.2f %9.2f %6s %10.2f %11.2f %11.2f\n", rows[k].n, "",
                exponent(&Costs::free), exponent(&Costs::held), exponent(&Costs::in_run), "",
                exponent(&Costs::jacobian), exponent(&Costs::direction),
                exponent(&Costs::next_direction));
  }
}

void Judge(const std::string& what, double value, double limit) {
  std::printf("  %s  %-58s %9.3g  (at most %.3g)\n", value <= limit ? "holds" : "FAILS",
              what.c_str(), value, limit);
}

void ReportLegs(int largest) {
  std::printf(
      "legged tables [us]: right-hand side in flight, as in the run, in the run, ratio;\n"
      "Jacobian of the field; cluster of n along its first direction, and along the next\n"
      "%4s %5s %7s %8s %9s %9s %9s %6s %10s %11s %11s\n",
      "n", "dof", "events", "rhs", "flight", "alone", "in run", "ratio", "Jacobian", "direction",
      "next");
  std::vector<Costs> rows;
  for (int n = 2; n <= largest; n *= 2) rows.push_back(Measure(n));
  PrintGrowth(rows);
  for (const Costs& row : rows) {
    Judge("right-hand side in a run / alone, n = " + std::to_string(static_cast<int>(row.n)),
          row.in_run / row.held, kLargestRatio);
    if (row.n == 32) Judge("a direction at n = 32 [s]", row.direction, kDirectionAt32);
    if (row.n == 64) Judge("a direction at n = 64 [s]", row.direction, kDirectionAt64);
  }
}

void ReportLinks(const char* what, int branching) {
  std::printf("%s [us]: right-hand side, its Jacobian; exponents\n", what);
  double before[3] = {0, 0, 0};
  for (const int dof : {7, 18, 36, 72, 144}) {
    Table table(Links(dof, branching));
    Vector x = table.system->nominal().x;
    for (Eigen::Index i = 0; i < x.size(); ++i) x(i) += 0.1 * std::sin(1.0 + i);
    const std::vector<double> seconds =
        TimeInterleaved({[&] { table.dynamics.Evaluate(x, ContactMode()); },
                         [&] { table.dynamics.Differentiate(x, ContactMode()); }});
    std::printf("%4d %9.2f %10.1f", dof, 1e6 * seconds[0], 1e6 * seconds[1]);
    if (before[0] > 0) {
      const double octave = std::log(dof / before[0]);
      std::printf("   %6.2f %6.2f", std::log(seconds[0] / before[1]) / octave,
                  std::log(seconds[1] / before[2]) / octave);
    }
    std::printf("\n");
    before[0] = dof;
    before[1] = seconds[0];
    before[2] = seconds[1];
  }
}

/// The gradient of a quadratic cost by one input on ever finer grids, backward and forward.
void ReportVariables() {
  std::printf(
      "steered_trot, an input on a grid [us]: intervals, run, its gradient, in runs, "
      "forward (A_k, B_k); exponents\n");
  const auto system = MakeModel("steered_trot", {});
  const NominalRun& nominal = system->nominal();
  QuadraticCost quadratic;
  quadratic.weight = Vector::LinSpaced(system->state_size(), 0.5, 1.5);
  const RunCost cost = quadratic.Make(*system);
  BDerivativeOptions options;
  options.variables.inputs = true;
  double before[4] = {0, 0, 0, 0};
  for (const int count : {1, 3, 10, 30, 100, 300, 1000}) {
    InputSchedule inputs;
    for (int k = 0; k < count; ++k) {
      inputs.grid.push_back(nominal.duration * k / count);
      inputs.values.push_back(Vector::Constant(1, 0.01 * std::sin(1.0 + k)));
    }
    const Trajectory run = Simulate(*system, nominal.x, inputs, nominal.duration);
    CostGradient gradient;
    const std::vector<double> seconds =
        TimeInterleaved({[&] { Simulate(*system, nominal.x, inputs, nominal.duration); },
                         [&] { gradient = DifferentiateCost(*system, run, cost, options); },
                         [&] { GridDerivative(*system, run, options); }},
                        2e-3, 3);
    if (!gradient.status.ok()) std::printf("  %s\n", gradient.status.message.c_str());
    std::printf("%6d %9.1f %9.1f %6.2f %10.1f", count, 1e6 * seconds[0], 1e6 * seconds[1],
                seconds[1] / seconds[0], 1e6 * seconds[2]);
    for (int i = 0; i < 3 && before[0] > 0; ++i) {
      std::printf(" %6.2f", std::log(seconds[static_cast<std::size_t>(i)] / before[i + 1]) /
                                std::log(count / before[0]));
    }
    std::printf("\n");
    before[0] = count;
    std::copy(seconds.begin(), seconds.end(), before + 1);
  }
}

int Loop(const std::string& what, int n, int count) {
  Table table(Legs(n));
  const Trajectory run = table.Run();
  double unused;
  for (int k = 0; k < count; ++k) {
    if (what == "rhs") table.dynamics.Evaluate(run.FinalState(), run.arcs.back().mode);
    if (what == "run") table.Run();
    if (what == "direction") Direction(table, run, &unused);
  }
  return 0;
}

}  // namespace
}  // namespace benchmark
}  // namespace contact_flow

int main(int argc, char** argv) {
  namespace benchmark = contact_flow::benchmark;
  if (argc == 5 && std::strcmp(argv[1], "--loop") == 0) {
    return benchmark::Loop(argv[2], std::atoi(argv[3]), std::atoi(argv[4]));
  }
  benchmark::ReportLegs(argc > 1 ? std::atoi(argv[1]) : 64);
  benchmark::ReportLinks("chains", 1);
  benchmark::ReportLinks("trees", 2);
  benchmark::ReportVariables();
  return 0;
}
