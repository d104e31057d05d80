// SPDX-License-Identifier: BSD-3-Clause
// The quadruped of config/robots with servos 1, 10 and 100 times as hard, by each method of
// integration: processor time, work, and events against a run at 1e-12.
//   stiff_benchmark config/robots/quadruped.yaml
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace {

using contact_flow::IntegrationMethod;

constexpr int kRepetitions = 5;  // the least time counts

double Seconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

contact_flow::SimulateOptions With(IntegrationMethod method, double tolerance) {
  contact_flow::SimulateOptions options;
  options.method = method;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  options.max_steps = 10000000;
  return options;
}

/// Largest difference of the instants of events [s]; infinite where they are not the same.
double EventError(const contact_flow::Trajectory& exact, const contact_flow::Trajectory& run) {
  if (exact.ModeSequence() != run.ModeSequence()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    worst = std::max(worst, std::abs(run.transitions[k].t - exact.transitions[k].t));
  }
  return worst;
}

void Compare(const char* file, double gain, double duration) {
  const auto robot =
      contact_flow::LoadRobot(file, {{"stiffness", 80 * gain}, {"damping", 3 * gain}});
  const contact_flow::NominalRun& nominal = robot->nominal();
  const auto simulate = [&](IntegrationMethod method, double tolerance) {
    return Simulate(*robot, nominal.x, nominal.u, duration, With(method, tolerance));
  };
  const contact_flow::Trajectory exact = simulate(IntegrationMethod::kExplicit, 1e-12);
  const char* const names[] = {"explicit", "implicit", "automatic"};
  double of_explicit = 0;
  for (int k = 0; k < 3; ++k) {
    const auto method = static_cast<IntegrationMethod>(k);
    double least = std::numeric_limits<double>::infinity();
    contact_flow::Trajectory run;
    for (int repetition = 0; repetition < kRepetitions; ++repetition) {
      const double begin = Seconds();
      run = simulate(method, 1e-8);
      least = std::min(least, Seconds() - begin);
    }
    if (k == 0) of_explicit = least;
    std::printf("| ×%g | %.1f | %s | %.2f | %ld | %ld | %ld | %ld | %.1e | %.1f |\n", gain,
                duration, names[k], 1e3 * least, run.statistics.steps,
                run.statistics.implicit_steps, run.statistics.field_evaluations,
                run.statistics.jacobians, EventError(exact, run), of_explicit / least);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const char* const file = argc > 1 ? argv[1] : "config/robots/quadruped.yaml";
  try {
    std::puts(
        "| servos | run [s] | method | time [ms] | steps | implicit | right-hand sides | "
        "Jacobians | events off by [s] | times as fast |");
    std::puts("|---|---|---|---|---|---|---|---|---|---|");
    for (double gain : {1, 10, 100}) {
      for (double duration : {0.2, 1.0}) Compare(file, gain, duration);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "stiff_benchmark: %s\n", error.what());
    return 1;
  }
  return 0;
}
