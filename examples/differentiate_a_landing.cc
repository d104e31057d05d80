// SPDX-License-Identifier: BSD-3-Clause
//
// A biped on spring legs lands on both feet at once. How does its pitch, 0.4 s later, depend on the
// pitch it was dropped with? Differently to either side: the outcome has a kink.
//
// Prints: pitch up: 0.9434 rad, pitch down: 0.8055 rad

#include <cstdio>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

int main() {
  using namespace contact_flow;

  // A model by name, with parameters by name; the rest of them, and the drop, are its defaults.
  const auto biped = MakeModel("soft_biped", {{"stiffness", 27}});
  const NominalRun& drop = biped->nominal();
  const SystemDescription& names = biped->description();

  const Trajectory run = Simulate(*biped, drop.x, drop.u, drop.duration);
  if (!run.status.ok()) {
    std::printf("%s\n", run.status.message.c_str());
    return 1;
  }
  for (const Transition& landing : run.transitions) {
    std::printf("t = %.6f s: %s -> %s\n", landing.t,
                landing.mode_before.ToString(names.constraints).c_str(),
                landing.mode_after.ToString(names.constraints).c_str());
  }

  const BDerivative derivative = DifferentiateOutcome(*biped, run);
  if (!derivative.status.ok()) {
    std::printf("%s\n", derivative.status.message.c_str());
    return 1;
  }
  const int pitch = biped->dof() - 1;
  Vector w = Vector::Zero(2 * biped->dof());  // (δq, δv): 1 rad of pitch
  w(pitch) = 1;
  std::printf("a radian of pitch at the start becomes, to first order, at %g s:\n", run.t_end());
  std::printf("pitch up: %.4f rad, ", derivative(w)(pitch));
  std::printf("pitch down: %.4f rad\n", -derivative(-w)(pitch));
  std::printf("continuously differentiable: %s; pieces: %zu\n",
              derivative.IsDifferentiable() ? "yes" : "no", derivative.Pieces().pieces().size());
}
