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

double KineticSpeed(const MatrixRef& mass, const VectorRef& v) {
  return std::sqrt(std::max(0.0, 2 * KineticEnergy(mass, v)));
}

double KineticEnergy(const MatrixRef& mass, const VectorRef& v) {
  if (Driven(mass).empty()) return 0.5 * v.dot(mass * v);
  const Vector moved = Moved(mass, v);
  return 0.5 * moved.dot(mass * moved);
}

}  // namespace contact_flow
