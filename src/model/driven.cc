// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/driven.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace contact_flow {
namespace {

/// The dynamics of a system at a state, by which velocities are found that nothing changes.
class Changes {
 public:
  Changes(const MechanicalSystem& system, const VectorRef& q, const VectorRef& v,
          const ContactMode& mode) {
    const Vector& u = system.nominal().u;
    system.Dynamics(q, v, u, mode, &mass_, &force_);
    system.DifferentiateDynamics(q, v, u, mode, Vector::Ones(system.dof()),
                                 Vector::Zero(system.num_rows()), &jacobian_);
  }

  /// Whether M v̇ = f has a row of velocity j alone, without a force, whatever the state.
  bool None(int j) const {
    Vector row = mass_.row(j);
    row(j) = 0;
    return row.isZero(0) && force_(j) == 0 && jacobian_.momentum_q.row(j).isZero(0) &&
           jacobian_.momentum_v.row(j).isZero(0) && jacobian_.momentum_u.row(j).isZero(0);
  }
  bool IsDriven(int j) const { return mass_(j, j) == kDrivenInertia; }

 private:
  Matrix mass_;
  Vector force_;
  ResidualJacobian jacobian_;
};

}  // namespace

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
  ConstraintTerms terms;
  system.Constraints(q, v, &terms);
  std::vector<std::pair<int, int>> candidates;  // constraint, coordinate
  for (int i : system.compliant()) {
    Eigen::Index j = 0;
    Vector row = terms.jacobian.row(i).cwiseAbs();
    if (!(row.maxCoeff(&j) > 0)) continue;
    row(j) = 0;
    if (row.isZero(0) && v(j) != 0) candidates.emplace_back(i, static_cast<int>(j));
  }
  if (candidates.empty()) return switches;
  const Changes open(system, q, v, {}), closed(system, q, v, ContactMode(system.compliant()));
  for (const auto& [i, j] : candidates) {
    bool held = false;  // by other constraints
    for (Eigen::Index row = 0; row < terms.jacobian.rows(); ++row) {
      const bool compliant =
          row < system.num_constraints() && system.compliant().Contains(static_cast<int>(row));
      held = held || (!compliant && terms.jacobian(row, j) != 0);
    }
    const bool steady = (open.None(j) && closed.None(j) && !held) || open.IsDriven(j);
    if (steady) switches.Insert(i);
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
