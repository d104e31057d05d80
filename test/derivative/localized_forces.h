// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {
namespace test {

/// Unit masses (and moments of inertia) on a configuration space of any kind, without
/// constraints, under
///   f = g + L x + Σ_b amplitude_b · shape_b(s) · push_b,   s = (along_b x − centre_b)/width_b,
/// x = (q, v) in numbers, where a shape is exp(−sᵀs) (a gust) or exp(−s₀) (a ground). Parameters
/// are amplitude and width of each. Written by hand in double, so that random ones
/// cost no compilation.
class LocalizedForces : public MechanicalSystem {
 public:
  struct Term {
    bool gust = true;
    double amplitude = 1, width = 1;
    Vector push;    // [d]
    Matrix along;   // [r × nq+d]
    Vector centre;  // [r]
  };

  LocalizedForces(const ConfigurationSpace& space, const Vector& g, const Matrix& L,
                  std::vector<Term> terms)
      : g_(g), L_(L), terms_(std::move(terms)) {
    space_ = space;
    description_.name = "localized_forces";
    description_.coordinates.assign(static_cast<std::size_t>(space.num_positions()), "q");
    description_.units.assign(static_cast<std::size_t>(space.num_positions()), "m");
    description_.velocities.assign(static_cast<std::size_t>(space.dof()), "v");
    for (std::size_t b = 0; b < terms_.size(); ++b) {
      description_.parameters.push_back(
          {"amplitude_" + std::to_string(b), "N", "", terms_[b].amplitude});
      description_.parameters.push_back({"width_" + std::to_string(b), "m", "", terms_[b].width});
    }
    nominal_.x = Vector::Zero(state_size());
    nominal_.u = Vector::Zero(0);
  }

  /// f, its Jacobian by the numbers x [d × nq+d] and by the parameters [d × 2 terms].
  void Force(const Vector& x, Vector* f, Matrix* by_x, Matrix* by_p) const {
    *f = g_ + L_ * x;
    *by_x = L_;
    by_p->setZero(dof(), static_cast<int>(2 * terms_.size()));
    for (std::size_t b = 0; b < terms_.size(); ++b) {
      const Term& term = terms_[b];
      const Vector s = (term.along * x - term.centre) / term.width;
      const double shape = std::exp(term.gust ? -s.squaredNorm() : -s(0));
      const Vector by_s =
          term.gust ? Vector(-2 * shape * s) : Vector(-shape * Vector::Unit(s.size(), 0));
      *f += term.amplitude * shape * term.push;
      *by_x += term.amplitude / term.width * term.push * (by_s.transpose() * term.along);
      by_p->col(static_cast<int>(2 * b)) = shape * term.push;
      by_p->col(static_cast<int>(2 * b) + 1) =
          -term.amplitude / term.width * by_s.dot(s) * term.push;
    }
  }

  /// N(q) [nq×d].
  Matrix Rates(const VectorRef& q) const {
    Matrix N(num_positions(), dof());
    Vector rate(num_positions());
    for (int j = 0; j < dof(); ++j) {
      space_.Rate(Vector(q).data(), Vector(Vector::Unit(dof(), j)).data(), rate.data());
      N.col(j) = rate;
    }
    return N;
  }

  void Dynamics(const VectorRef& q, const VectorRef& v, const VectorRef&, const ContactMode&,
                Matrix* mass, Vector* force) const override {
    if (mass != nullptr) mass->setIdentity(dof(), dof());
    Matrix by_x, by_p;
    Force(State(q, v), force, &by_x, &by_p);
  }
  void Constraints(const VectorRef&, const VectorRef&, ConstraintTerms* terms) const override {
    terms->gap.resize(0);
    terms->jacobian.resize(0, dof());
    terms->bias.resize(0);
  }
  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef&,
                             const ContactMode&, const VectorRef&, const VectorRef&,
                             ResidualJacobian* jacobian) const override {
    Vector f;
    Matrix by_x, by_p;
    Force(State(q, v), &f, &by_x, &by_p);
    jacobian->momentum_q = -by_x.leftCols(num_positions()) * Rates(q);
    jacobian->momentum_v = -by_x.rightCols(dof());
    jacobian->momentum_u.resize(dof(), 0);
    jacobian->constraint_q.resize(0, dof());
    jacobian->constraint_v.resize(0, dof());
  }
  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef&,
                                         const ContactMode&, const VectorRef&, const VectorRef&,
                                         const std::vector<int>& parameters,
                                         ParameterJacobian* jacobian) const override {
    Vector f;
    Matrix by_x, by_p;
    Force(State(q, v), &f, &by_x, &by_p);
    jacobian->momentum.resize(dof(), static_cast<int>(parameters.size()));
    for (std::size_t c = 0; c < parameters.size(); ++c) {
      jacobian->momentum.col(static_cast<int>(c)) = -by_p.col(parameters[c]);
    }
    jacobian->constraint.resize(0, static_cast<int>(parameters.size()));
  }
  void DifferentiateImpact(const VectorRef&, const VectorRef&, const VectorRef&, const VectorRef&,
                           ResidualJacobian*) const override {
    throw std::logic_error("there are no impacts");
  }
  void DifferentiateImpactByParameters(const VectorRef&, const VectorRef&, const VectorRef&,
                                       const VectorRef&, const std::vector<int>&,
                                       ParameterJacobian*) const override {
    throw std::logic_error("there are no impacts");
  }

 private:
  static Vector State(const VectorRef& q, const VectorRef& v) {
    Vector x(q.size() + v.size());
    x << q, v;
    return x;
  }

  const Vector g_;
  const Matrix L_;
  const std::vector<Term> terms_;
};

}  // namespace test
}  // namespace contact_flow
