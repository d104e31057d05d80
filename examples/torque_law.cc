// SPDX-License-Identifier: BSD-3-Clause
//
// A double pendulum reaches the stops of both joints at once. Moved at the shoulder, it reaches one
// first: which constant shoulder torque brings the elbow back to its nominal final angle? A law
// with a kink.
//
// Prints: slope of the law: -0.4402 N m/rad below, -1.5875 above

#include <cmath>
#include <cstdio>

#include "contact_flow/contact_flow.h"

int main() {
  using namespace contact_flow;
  const auto pendulum = MakeModel("double_pendulum");
  const NominalRun& nominal = pendulum->nominal();

  // ½ (elbow(T) − nominal)², to be made zero by the shoulder torque.
  OutcomeProblem problem;
  problem.u = nominal.u;
  problem.duration = nominal.duration;
  problem.unknowns = {{OutcomeUnknown::Kind::kInput, 0}};
  problem.target =
      Simulate(*pendulum, nominal.x, nominal.u, nominal.duration, problem.simulate).FinalState();
  problem.weight = Vector::Unit(4, 1);
  problem.effort = Vector::Zero(2);
  DescentOptions options;
  options.tolerance = 1e-10;

  std::printf("shoulder [rad]   torque [N m]\n");
  double beside[2] = {0, 0};
  constexpr double kBeside = 1e-5;
  for (double offset : {-0.1, -0.05, -0.02, -kBeside, 0.0, kBeside, 0.02, 0.05, 0.1}) {
    problem.x = nominal.x;
    problem.x(0) += offset;
    const DescentResult found =
        Minimize(MakeOutcomeCost(*pendulum, problem), Vector::Zero(1), options);
    if (!(found.cost < 1e-12)) {
      std::printf("%s\n", found.message.c_str());
      return 1;
    }
    std::printf("%14g %14.8f\n", offset, found.y(0));
    if (std::abs(offset) == kBeside) beside[offset > 0] = found.y(0) / offset;
  }
  std::printf("slope of the law: %.4f N m/rad below, %.4f above\n", beside[0], beside[1]);
}
