// SPDX-License-Identifier: BSD-3-Clause
#include <contact_flow/derivative/b_derivative.h>
#include <contact_flow/flow/simulate.h>
#include <contact_flow/model/model_library.h>
#include <contact_flow/model/model_registry.h>
#include <contact_flow/model/model_system.h>

#include <iostream>

#include "dropped_ball.h"

int main() {
  contact_flow::RegisterModel<my_models::DroppedBall>();
  const auto ball = contact_flow::MakeModel("dropped_ball", {{"restitution", 0.8}});
  const contact_flow::NominalRun& drop = ball->nominal();
  const contact_flow::Trajectory run = Simulate(*ball, drop.x, drop.u, drop.duration);
  const contact_flow::BDerivative derivative = DifferentiateOutcome(*ball, run);
  std::cout << "dz/dz0 = " << derivative(contact_flow::Vector::Unit(2, 0))(0) << "\n";
}
