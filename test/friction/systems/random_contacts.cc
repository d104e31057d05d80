// SPDX-License-Identifier: BSD-3-Clause
#include "test/friction/systems/random_contacts.h"

#include <string>
#include <utility>

namespace contact_flow {
namespace test {

RandomContacts::RandomContacts(ContactCoefficients coefficients) : c_(std::move(coefficients)) {
  const int n = contacts(), d = static_cast<int>(c_.mass.rows());
  description_.name = "random_contacts";
  for (int k = 0; k < d; ++k) {
    description_.coordinates.push_back("q" + std::to_string(k));
    description_.units.push_back("m");
    description_.velocities.push_back("q" + std::to_string(k));
  }
  space_ = ConfigurationSpace(d);
  restitution_ = c_.restitution;
  num_tangential_ = n * c_.rows;
  for (int i = 0; i < n; ++i) {
    const std::string number = std::to_string(i);
    description_.constraints.push_back("contact" + number);
    friction_.push_back({c_.friction(i), n + i * c_.rows, c_.rows});
  }
  for (int i = 0; i < n; ++i) {
    description_.parameters.push_back({"mu" + std::to_string(i), "", "friction", c_.friction(i)});
  }
  for (int i = 0; i < n; ++i) {
    description_.parameters.push_back(
        {"gamma" + std::to_string(i), "", "restitution", c_.restitution(i)});
  }
  nominal_.x = Vector::Zero(2 * d);
  nominal_.u = Vector::Zero(0);
}

void RandomContacts::Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef&,
                              const ContactMode&, Matrix* mass, Vector* force) const {
  if (mass != nullptr) *mass = c_.mass;
  *force = c_.load - c_.stiffness * q - c_.damping * v;
}

Matrix RandomContacts::Turned(const VectorRef& s) const {
  const int n = contacts(), d = static_cast<int>(c_.mass.rows());
  Matrix turned(n + n * c_.rows, d);
  for (int i = 0; i < n; ++i) turned.row(i) = (c_.curvatures[i] * s).transpose();
  for (int k = 0; k < d; ++k) turned.col(k).tail(n * c_.rows) = c_.turning[k] * s;
  return turned;
}

Matrix RandomContacts::Pushed(const VectorRef& force) const {
  const int n = contacts(), d = static_cast<int>(c_.mass.rows());
  Matrix pushed = Matrix::Zero(d, d);
  for (int i = 0; i < n; ++i) pushed += force(i) * c_.curvatures[i];
  for (int k = 0; k < d; ++k) {
    pushed.col(k) += c_.turning[k].transpose() * force.tail(n * c_.rows);
  }
  return pushed;
}

void RandomContacts::Constraints(const VectorRef& q, const VectorRef& v,
                                 ConstraintTerms* terms) const {
  const int n = contacts(), r = n * c_.rows;
  const Matrix turned = Turned(q);
  terms->gap = Vector::Zero(n + r);
  terms->gap.head(n) = c_.offset + c_.normals * q + 0.5 * turned.topRows(n) * q;
  terms->jacobian.resize(n + r, q.size());
  terms->jacobian.topRows(n) = c_.normals + turned.topRows(n);
  Matrix T = c_.tangents;
  for (int k = 0; k < q.size(); ++k) T += q(k) * c_.turning[k];
  terms->jacobian.bottomRows(r) = T;
  terms->bias = Turned(v) * v;
}

void RandomContacts::DifferentiateDynamics(const VectorRef&, const VectorRef& v, const VectorRef&,
                                           const ContactMode&, const VectorRef& acceleration,
                                           const VectorRef& force,
                                           ResidualJacobian* jacobian) const {
  const int n = contacts(), d = static_cast<int>(c_.mass.rows()), r = n * c_.rows;
  jacobian->momentum_q = c_.stiffness - Pushed(force);
  jacobian->momentum_v = c_.damping;
  jacobian->momentum_u.resize(d, 0);
  jacobian->constraint_q = Turned(acceleration);
  Matrix by_velocity = Turned(v);  // of the second factor
  by_velocity.topRows(n) *= 2;
  for (int k = 0; k < d; ++k) by_velocity.bottomRows(r) += v(k) * c_.turning[k];
  jacobian->constraint_v = by_velocity;
}

void RandomContacts::DifferentiateImpact(const VectorRef&, const VectorRef&,
                                         const VectorRef& impulse, const VectorRef& s,
                                         ResidualJacobian* jacobian) const {
  jacobian->momentum_q = -Pushed(impulse);
  jacobian->constraint_q = Turned(s);
}

void RandomContacts::DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef&,
                                                       const VectorRef&, const ContactMode&,
                                                       const VectorRef&, const VectorRef&,
                                                       const std::vector<int>& parameters,
                                                       ParameterJacobian* jacobian) const {
  const auto k = static_cast<Eigen::Index>(parameters.size());
  jacobian->momentum = Matrix::Zero(q.size(), k);
  jacobian->constraint = Matrix::Zero(num_rows(), k);
}

void RandomContacts::DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                                     const VectorRef& impulse, const VectorRef& s,
                                                     const std::vector<int>& parameters,
                                                     ParameterJacobian* jacobian) const {
  DifferentiateDynamicsByParameters(q, s, Vector::Zero(0), ContactMode(), jump, impulse, parameters,
                                    jacobian);
  const auto k = static_cast<Eigen::Index>(parameters.size());
  jacobian->gap = Matrix::Zero(num_rows(), k);
  jacobian->restitution = Matrix::Zero(contacts(), k);
  for (Eigen::Index j = 0; j < k; ++j) {
    const int i = parameters[j] - contacts();
    if (i >= 0) jacobian->restitution(i, j) = 1;
  }
}

Matrix RandomContacts::DifferentiateFriction(const std::vector<int>& parameters) const {
  Matrix by = Matrix::Zero(contacts(), static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const int i = parameters[j];
    if (i < contacts() && std::isfinite(c_.friction(i))) by(i, static_cast<Eigen::Index>(j)) = 1;
  }
  return by;
}

}  // namespace test
}  // namespace contact_flow
