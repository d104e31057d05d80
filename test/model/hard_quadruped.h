// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"

namespace contact_flow {

/// The quadruped with servos so many times as hard.
inline std::unique_ptr<RobotSystem> HardQuadruped(double gain) {
  return LoadRobot(RobotFile("quadruped"), {{"stiffness", 80 * gain}, {"damping", 3 * gain}});
}

/// Tilted, it lands foot by foot, and feet come off again.
inline Vector Tilted(const RobotSystem& quadruped) {
  Vector w = Vector::Zero(36);
  w(3) = 0.06;
  w(4) = 0.1;
  w(19) = 0.2;
  return quadruped.Perturb(quadruped.nominal().x, w);
}

inline SimulateOptions With(IntegrationMethod method, double tolerance) {
  SimulateOptions options;
  options.method = method;
  options.relative_tolerance = options.absolute_tolerance = tolerance;
  options.max_steps = 1000000;
  return options;
}

}  // namespace contact_flow
