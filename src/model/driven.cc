// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/driven.h"

#include <algorithm>
#include <cmath>

namespace contact_flow {

std::vector<int> Driven(const MatrixRef& mass) {
  std::vector<int> driven;
  for (Eigen::Index j = 0; j < mass.rows(); ++j) {
    if (mass(j, j) == kDrivenInertia) driven.push_back(static_cast<int>(j));
  }
  return driven;
}

Vector Moved(const MatrixRef& mass, const VectorRef& v) {
  Vector moved = v;
  for (int j : Driven(mass)) moved(j) = 0;
  return moved;
}

ConstraintSet DrivenSwitches(const MechanicalSystem& system, const VectorRef& q,
                             const VectorRef& v) {
  ConstraintSet switches;
  if (system.compliant().Empty()) return switches;
  Matrix mass;
  Vector force;
  system.Dynamics(q, v, system.nominal().u, ContactMode(), &mass, &force);
  const std::vector<int> driven = Driven(mass);
  if (driven.empty()) return switches;
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  for (int i : system.compliant()) {
    Vector row = terms.jacobian.row(i);
    const bool moves = row.dot(v) != 0;
    for (int j : driven) row(j) = 0;
    if (moves && row.isZero(0)) switches.Insert(i);
  }
  return switches;
}

double KineticSpeed(const MatrixRef& mass, const VectorRef& v) {
  return std::sqrt(std::max(0.0, 2 * KineticEnergy(mass, v)));
}

double KineticEnergy(const MatrixRef& mass, const VectorRef& v) {
  if (Driven(mass).empty()) return 0.5 * v.dot(mass * v);
  const Vector moved = Moved(mass, v);
  return 0.5 * moved.dot(mass * moved);
}

}  // namespace contact_flow
