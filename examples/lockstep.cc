// SPDX-License-Identifier: BSD-3-Clause
//
// A controller in lockstep with the simulation, at 2 kHz: look at the state, decide, go on by half
// a millisecond. Here it holds a double pendulum at angles of its own; with a robot's YAML as
// argument it plays with the inputs of that robot, to see how fast the loop is.
//
// Prints: 4000 steps to t = 2 s, shoulder 0.300, elbow -0.200

#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>

#include "contact_flow/flow/online_flow.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"

int main(int count, char** words) {
  using contact_flow::Vector;
  std::shared_ptr<const contact_flow::MechanicalSystem> system;
  std::function<Vector(const Vector&)> Control;
  if (count > 1) {
    system = contact_flow::LoadRobot(words[1]);
    Control = [&](const Vector& x) -> Vector {
      return system->nominal().u + Vector::Constant(system->num_inputs(), 1e-3 * std::sin(x(0)));
    };
  } else {
    system = contact_flow::MakeModel("double_pendulum");
    Control = [](const Vector& x) {
      return Vector(-40 * (x.head(2) - Eigen::Vector2d(0.3, -0.2)) - 10 * x.tail(2));
    };
  }

  const auto begin = std::chrono::steady_clock::now();
  contact_flow::OnlineFlow flow(system, 0, system->nominal().x, system->nominal().u, {});
  for (int k = 1; k <= 4000; ++k) {
    flow.SetInput(flow.now(), Control(flow.State()));
    const double next = k / 2000.0;
    while (flow.AdvanceTo(next)) {  // stops at each event
    }
  }
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;

  const Vector x = flow.State();
  if (!flow.status().ok()) std::printf("%s\n", flow.status().message.c_str());
  std::printf("4000 steps to t = %.0f s, %s %.3f, %s %.3f\n", flow.now(),
              system->description().coordinates[0].c_str(), x(0),
              system->description().coordinates[1].c_str(), x(1));
  std::printf("%.0f steps a second\n", 4000 / spent.count());
}
