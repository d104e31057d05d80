// SPDX-License-Identifier: BSD-3-Clause
#include "arc_units.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

constexpr double kTiny = 1e-150;  // a coordinate without inertia
/// A unit is taken from the bodies where it is this many times the largest of theirs.
constexpr double kApartFromBodies = 10;

}  // namespace

ArcUnits::ArcUnits(const ContactDynamics& dynamics, const Arc& arc) {
  const MechanicalSystem& system = dynamics.system();
  const int d = system.dof();
  const auto q = arc.x_begin.head(system.num_positions()), v = arc.x_begin.tail(d);
  Matrix mass;
  Vector force;
  system.Dynamics(q, v, dynamics.u(), arc.mode, &mass, &force);
  length = mass.diagonal().cwiseAbs().cwiseMax(kTiny).cwiseSqrt();
  source = Vector::Ones(dynamics.num_variables());
  const std::vector<int> driven = Driven(mass);
  for (int j : driven) length(j) = 1;
  if (!(length.maxCoeff() > kApartFromBodies * length.minCoeff())) return;
  const auto is_driven = [&](int j) {
    return std::find(driven.begin(), driven.end(), j) != driven.end();
  };
  std::vector<int> alone;
  double bodies = 0, clocks = 0;  // the largest units
  for (int j = 0; j < d; ++j) {
    const bool coupled = mass.col(j).cwiseAbs().sum() > std::abs(mass(j, j));
    const bool clock = is_driven(j) || (force(j) == 0 && !coupled);
    if (clock) alone.push_back(j);
    double& largest = clock ? clocks : bodies;
    largest = std::max(largest, length(j));
  }
  if (!(bodies > 0) || !(clocks > kApartFromBodies * bodies)) return;
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  for (int j : alone) {
    const bool moved = !is_driven(j) && !terms.jacobian.col(j).isZero(0);
    if (!moved && length(j) > kApartFromBodies * bodies) length(j) = bodies;
  }
}

}  // namespace contact_flow
