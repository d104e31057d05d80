// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The robots of public proportions, "quadruped" and "humanoid".
inline std::string DropFile(const std::string& robot) {
  return std::string(CONTACT_FLOW_TEST_DATA) + "/drop_" + robot + ".yaml";
}

/// Gives every contact of such a robot a coefficient of friction.
inline void AddFriction(double coefficient, std::string* yaml) {
  const std::string key = ", friction: " + std::to_string(coefficient), before = ", radius:";
  for (std::size_t at = 0; (at = yaml->find(before, at)) != std::string::npos;
       at += key.size() + before.size()) {
    yaml->insert(at, key);
  }
}

/// The state with the lowest contact point up to 0.5 m above the ground; every fourth is level, the
/// others are tilted by up to 0.5 rad about any horizontal axis, with up to 0.1 rad on each joint.
inline Vector RandomDrop(const MechanicalSystem& system, int seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const int nq = system.num_positions(), d = system.dof();
  const double height = 0.25 * (1 + uniform(generator));
  const double tilt = 0.5 * std::abs(uniform(generator)), heading = M_PI * uniform(generator);
  Vector w = Vector::Zero(2 * d);
  if (seed % 4 != 0) {
    w(3) = tilt * std::cos(heading);
    w(4) = tilt * std::sin(heading);
    for (int j = 6; j < d; ++j) w(j) = 0.1 * uniform(generator);
  }
  Vector x = system.Perturb(system.nominal().x, w);
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  x(2) += height - terms.gap.minCoeff();
  return x;
}

}  // namespace contact_flow
