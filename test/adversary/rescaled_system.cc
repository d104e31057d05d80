// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/rescaled_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace contact_flow {
namespace adversary {

Units Units::Same(int d, int n) {
  Units units;
  units.length = Vector::Ones(d);
  units.gap = Vector::Ones(n);
  for (int i = 0; i < d; ++i) units.coordinate.push_back(i);
  for (int i = 0; i < n; ++i) units.constraint.push_back(i);
  return units;
}

Vector Units::State(const Vector& x) const {
  const Eigen::Index d = length.size();
  Vector y(2 * d);
  for (Eigen::Index i = 0; i < d; ++i) {
    y(coordinate[i]) = length(i) * x(i);
    y(d + coordinate[i]) = length(i) / time * x(d + i);
  }
  return y;
}

Vector Units::Back(const Vector& y) const {
  const Eigen::Index d = length.size();
  Vector x(2 * d);
  for (Eigen::Index i = 0; i < d; ++i) {
    x(i) = y(coordinate[i]) / length(i);
    x(d + i) = y(d + coordinate[i]) / (length(i) / time);
  }
  return x;
}

SimulateOptions Units::Scale(const SimulateOptions& options) const {
  SimulateOptions scaled = options;
  const double smallest = length.minCoeff() * std::min(1.0, 1 / time);
  scaled.absolute_tolerance = std::clamp(options.absolute_tolerance * smallest, 1e-15, 1e-2);
  const double gap_unit = gap.size() > 0 ? gap.minCoeff() : 1;
  scaled.gap_tolerance *= gap_unit;
  scaled.speed_tolerance *= gap_unit / time;
  scaled.simultaneity_tolerance *= time;
  scaled.zeno_interval *= time;
  scaled.max_step *= time;
  return scaled;
}

RescaledSystem::RescaledSystem(const MechanicalSystem& system, Units units)
    : system_(system), units_(std::move(units)) {
  const int d = system.dof(), n = system.num_constraints(), rows = system.num_rows();
  description_ = system.description();
  nominal_ = system.nominal();
  space_ = ConfigurationSpace(d);
  restitution_ = system.restitution();
  to_old_ = force_ = Matrix::Zero(d, d);
  gaps_ = multiplier_ = Matrix::Zero(rows, rows);
  num_tangential_ = system.num_tangential();
  friction_ = system.friction();
  const double energy = units_.mass / (units_.time * units_.time);
  for (int i = 0; i < d; ++i) {
    const int place = units_.coordinate[i];
    to_old_(i, place) = 1 / units_.length(i);
    force_(place, i) = energy / units_.length(i);
    description_.coordinates[place] = system.description().coordinates[i];
  }
  description_.velocities = description_.coordinates;
  for (int i = 0; i < n; ++i) {
    const int place = units_.constraint[i];
    PlaceRow(i, place, units_.gap(i));
    description_.constraints[place] = system.description().constraints[i];
    restitution_(place) = system.restitution()(i);
    if (system.HasFriction()) friction_[place] = system.friction()[i];
  }
  // The rows of the tangents in the order of the contacts' new places.
  int row = n;
  for (int place = 0; system.HasFriction() && place < n; ++place) {
    Friction& friction = friction_[place];
    const auto contact = std::find(units_.constraint.begin(), units_.constraint.end(), place);
    const double unit = units_.gap(contact - units_.constraint.begin());
    for (int k = 0; k < friction.dimension; ++k) PlaceRow(friction.row + k, row + k, unit);
    friction.row = row;
    row += friction.dimension;
  }
}

void RescaledSystem::PlaceRow(int row, int place, double unit) {
  gaps_(place, row) = unit;
  multiplier_(row, place) = unit * units_.time * units_.time / units_.mass;
}

void RescaledSystem::Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                              const ContactMode& mode, Matrix* mass, Vector* force) const {
  Vector old;
  Matrix old_mass;
  system_.Dynamics(Q(q), V(v), u, mode, mass != nullptr ? &old_mass : nullptr, &old);
  if (mass != nullptr) {
    *mass = units_.time * units_.time * (force_ * old_mass * to_old_);
    *mass = (0.5 * (*mass + mass->transpose())).eval();
  }
  *force = force_ * old;
}

void RescaledSystem::Constraints(const VectorRef& q, const VectorRef& v,
                                 ConstraintTerms* terms) const {
  ConstraintTerms old;
  system_.Constraints(Q(q), V(v), &old);
  terms->gap = gaps_ * old.gap;
  terms->jacobian = gaps_ * old.jacobian * to_old_;
  terms->bias = gaps_ * old.bias / (units_.time * units_.time);
}

void RescaledSystem::DifferentiateDynamics(const VectorRef& q, const VectorRef& v,
                                           const VectorRef& u, const ContactMode& mode,
                                           const VectorRef& acceleration, const VectorRef& force,
                                           ResidualJacobian* jacobian) const {
  ResidualJacobian old;
  system_.DifferentiateDynamics(Q(q), V(v), u, mode, A(acceleration), multiplier_ * force, &old);
  const double time = units_.time;
  jacobian->momentum_q = force_ * old.momentum_q * to_old_;
  jacobian->momentum_v = time * (force_ * old.momentum_v * to_old_);
  jacobian->momentum_u = force_ * old.momentum_u;
  jacobian->constraint_q = gaps_ * old.constraint_q * to_old_ / (time * time);
  jacobian->constraint_v = gaps_ * old.constraint_v * to_old_ / time;
}

void RescaledSystem::DifferentiateImpact(const VectorRef& q, const VectorRef& jump,
                                         const VectorRef& impulse, const VectorRef& s,
                                         ResidualJacobian* jacobian) const {
  const double time = units_.time;
  ResidualJacobian old;
  system_.DifferentiateImpact(Q(q), V(jump), multiplier_ * impulse / time, V(s), &old);
  jacobian->momentum_q = time * (force_ * old.momentum_q * to_old_);
  jacobian->constraint_q = gaps_ * old.constraint_q * to_old_ / time;
}

void RescaledSystem::DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v,
                                                       const VectorRef& u, const ContactMode& mode,
                                                       const VectorRef& acceleration,
                                                       const VectorRef& force,
                                                       const std::vector<int>& parameters,
                                                       ParameterJacobian* jacobian) const {
  ParameterJacobian old;
  system_.DifferentiateDynamicsByParameters(Q(q), V(v), u, mode, A(acceleration),
                                            multiplier_ * force, parameters, &old);
  jacobian->momentum = force_ * old.momentum;
  jacobian->constraint = gaps_ * old.constraint / (units_.time * units_.time);
}

void RescaledSystem::DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                                     const VectorRef& impulse, const VectorRef& s,
                                                     const std::vector<int>& parameters,
                                                     ParameterJacobian* jacobian) const {
  const double time = units_.time;
  ParameterJacobian old;
  system_.DifferentiateImpactByParameters(Q(q), V(jump), multiplier_ * impulse / time, V(s),
                                          parameters, &old);
  jacobian->momentum = time * (force_ * old.momentum);
  jacobian->constraint = gaps_ * old.constraint / time;
  jacobian->gap = gaps_ * old.gap;
  jacobian->restitution = Placed(old.restitution);
}

Matrix RescaledSystem::DifferentiateFriction(const std::vector<int>& parameters) const {
  return Placed(system_.DifferentiateFriction(parameters));
}

Matrix RescaledSystem::Placed(const Matrix& rows) const {
  Matrix placed = rows;
  for (int i = 0; i < rows.rows(); ++i) placed.row(units_.constraint[i]) = rows.row(i);
  return placed;
}

}  // namespace adversary
}  // namespace contact_flow
