// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/dop853.h"

namespace contact_flow {
namespace test {

/// The state from which free motion arrives at (0, v) after `flight`: the motion run backwards.
inline Vector BeforeFlight(const MechanicalSystem& system, const Vector& v, double flight) {
  const int n = 2 * system.dof();
  ContactDynamics dynamics(system, Vector(0));
  Dop853 stepper(n, [&](const double* x, double* xdot) {
    Eigen::Map<Vector>(xdot, n) = -dynamics.Field(Eigen::Map<const Vector>(x, n), {});
  });
  Vector x = Vector::Zero(n);
  x.tail(system.dof()) = v;
  stepper.Begin(x);
  for (int k = 0; k < 20; ++k) {
    stepper.TryStep(flight / 20, 1e-13, 1e-13);
    stepper.Finish();
    stepper.Advance();
  }
  return stepper.begin();
}

}  // namespace test
}  // namespace contact_flow
