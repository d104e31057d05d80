// SPDX-License-Identifier: BSD-3-Clause
//
//   call_benchmark [seconds]
//
// What calls cost in C++; benchmark/python_calls.py puts the same from Python beside it. One line a
// call, with its name and processor time [µs].
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "timing.h"

namespace contact_flow {
namespace {

struct Call {
  std::string name;
  std::function<void()> call;
};

int Run(double seconds) {
  const auto system = MakeModel("soft_biped", {});
  const Vector x = system->nominal().x;
  const InputSchedule inputs = InputSchedule::Constant(system->nominal().u);
  const SimulateOptions options;
  const auto run = std::make_shared<Trajectory>(
      Simulate(*system, x, inputs, system->nominal().duration, options));
  const BDerivative map = DifferentiateOutcome(*system, *run);
  const Vector w = Vector::Unit(2 * system->dof(), 6);
  std::vector<Call> calls;
  for (const double duration : {0.0, 0.01, 1.4}) {
    calls.push_back({"simulate " + std::to_string(duration).substr(0, 4),
                     [&, duration] { Simulate(*system, x, inputs, duration, options); }});
  }
  calls.push_back({"run.x(t)", [&] { run->State(0.7); }});
  calls.push_back({"B(w)", [&] { map(w); }});
  std::vector<std::function<void()>> tasks;
  for (const Call& call : calls) tasks.push_back(call.call);
  const std::vector<double> times = benchmark::TimeInterleaved(tasks, seconds, 15);
  for (std::size_t k = 0; k < calls.size(); ++k) {
    std::printf("%-14s %9.3f\n", calls[k].name.c_str(), 1e6 * times[k]);
  }
  return 0;
}

}  // namespace
}  // namespace contact_flow

int main(int argc, char** argv) { return contact_flow::Run(argc > 1 ? std::atof(argv[1]) : 0.02); }
