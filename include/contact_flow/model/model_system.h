// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>

#include "contact_flow/autodiff.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/make_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// A MechanicalSystem from a model written once as templates. `Model` provides (see
/// model/example/soft_biped.h):
///   kName, kSummary                                    what it is
///   kDof, kConstraints, kInputs                        d, n, m
///   kConstantMass, kAffineConstraints                  promises that save work
///   kCoordinates, kUnits, kConstraintNames, kInputNames   names, arrays of const char*
///   template <class P> struct Parameters               with Visit(visitor) over all of them
///   MassMatrix(p, q, M)    M(q), full and symmetric    [d×d]
///   Force(p, q, v, u, f)   f(q, v, u), no Coriolis     [d]
///   Gaps(p, q, a)          a(q)                        [n]
///   Restitution(p, i)      γ_i
///   Nominal(p)             the run of a user who asks for nothing in particular
/// Coriolis terms, constraint Jacobians and all derivatives follow by automatic differentiation.
template <class Model>
class ModelSystem final : public MechanicalSystem {
  static constexpr int D = Model::kDof;
  static constexpr int N = Model::kConstraints;
  static constexpr int U = Model::kInputs;
  template <class S>
  using Config = Eigen::Matrix<S, D, 1>;
  template <class S>
  using Input = Eigen::Matrix<S, U, 1>;
  template <class S>
  using Gap = Eigen::Matrix<S, N, 1>;
  template <class S>
  using Mass = Eigen::Matrix<S, D, D>;
  /// Directions (δq, δv, δu) of the first derivatives, padded to a whole number of SIMD lanes.
  static constexpr int kDirections = (2 * D + U + 1) / 2 * 2;

 public:
  explicit ModelSystem(const ParameterValues& values) {
    description_.name = Model::kName;
    description_.summary = Model::kSummary;
    description_.coordinates.assign(Model::kCoordinates.begin(), Model::kCoordinates.end());
    description_.units.assign(Model::kUnits.begin(), Model::kUnits.end());
    description_.constraints.assign(Model::kConstraintNames.begin(), Model::kConstraintNames.end());
    description_.inputs.assign(Model::kInputNames.begin(), Model::kInputNames.end());
    description_.parameters = ReadParameters(Model::kName, values, &parameters_);
    restitution_.resize(N);
    for (int i = 0; i < N; ++i) restitution_(i) = Model::Restitution(parameters_, i);
    nominal_ = Model::Nominal(parameters_);
    const Config<double> origin = nominal_.x.template head<D>();
    if (Model::kConstantMass) Model::MassMatrix(parameters_, origin, &constant_mass_);
    if (Model::kAffineConstraints) constant_jacobian_ = GapJacobian<double>(origin);
  }

  bool HasConstantMass() const override { return Model::kConstantMass; }
  bool HasAffineConstraints() const override { return Model::kAffineConstraints; }

  void Dynamics(const VectorRef& q_in, const VectorRef& v_in, const VectorRef& u_in, Matrix* mass,
                Vector* force) const override {
    const Config<double> q = q_in, v = v_in;
    const Input<double> u = u_in;
    Config<double> f;
    Model::Force(parameters_, q, v, u, &f);
    if constexpr (Model::kConstantMass) {
      if (mass != nullptr) *mass = constant_mass_;
    } else {
      Mass<double> M;
      const Config<double> zero = Config<double>::Zero();
      f -= InertialForce<double>(q, v, zero, &M);
      if (mass != nullptr) *mass = M;
    }
    *force = f;
  }

  void Constraints(const VectorRef& q_in, const VectorRef& v_in,
                   ConstraintTerms* terms) const override {
    const Config<double> q = q_in;
    Gap<double> a;
    Model::Gaps(parameters_, q, &a);
    terms->gap = a;
    if constexpr (Model::kAffineConstraints) {
      terms->jacobian = constant_jacobian_;
      terms->bias.setZero(N);
    } else {
      const Config<double> v = v_in, zero = Config<double>::Zero();
      terms->jacobian = GapJacobian<double>(q);
      terms->bias = GapAcceleration<double>(q, v, zero);
    }
  }

  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const VectorRef& acceleration, const VectorRef& force,
                             ResidualJacobian* jacobian) const override {
    using S = Dual<double, kDirections>;
    Config<S> Q, V, a;
    Input<S> W;
    Gap<S> lambda;
    for (int k = 0; k < D; ++k) {
      Q(k) = S::Variable(q(k), k);
      V(k) = S::Variable(v(k), D + k);
      a(k) = S::Constant(acceleration(k));
    }
    for (int k = 0; k < U; ++k) W(k) = S::Variable(u(k), 2 * D + k);
    for (int i = 0; i < N; ++i) lambda(i) = S::Constant(force(i));
    Config<S> r1;
    Model::Force(parameters_, Q, V, W, &r1);
    for (int k = 0; k < D; ++k) r1(k) = -r1(k);
    if constexpr (!Model::kConstantMass) {
      Mass<S> M;
      const Config<S> inertial = InertialForce<S>(Q, V, a, &M);
      for (int k = 0; k < D; ++k) r1(k) += inertial(k);
    }
    if constexpr (!Model::kAffineConstraints) {
      const Config<S> push = ConstraintForce<S>(Q, lambda);
      for (int k = 0; k < D; ++k) r1(k) -= push(k);
      const Gap<S> r2 = GapAcceleration<S>(Q, V, a);
      jacobian->constraint_q.resize(N, D);
      jacobian->constraint_v.resize(N, D);
      for (int i = 0; i < N; ++i) {
        for (int j = 0; j < D; ++j) {
          jacobian->constraint_q(i, j) = r2(i).d[j];
          jacobian->constraint_v(i, j) = r2(i).d[D + j];
        }
      }
    } else {
      jacobian->constraint_q.setZero(N, D);
      jacobian->constraint_v.setZero(N, D);
    }
    jacobian->momentum_q.resize(D, D);
    jacobian->momentum_v.resize(D, D);
    jacobian->momentum_u.resize(D, U);
    for (int k = 0; k < D; ++k) {
      for (int j = 0; j < D; ++j) {
        jacobian->momentum_q(k, j) = r1(k).d[j];
        jacobian->momentum_v(k, j) = r1(k).d[D + j];
      }
      for (int j = 0; j < U; ++j) jacobian->momentum_u(k, j) = r1(k).d[2 * D + j];
    }
  }

  void DifferentiateImpact(const VectorRef& q, const VectorRef& jump, const VectorRef& impulse,
                           const VectorRef& s, ResidualJacobian* jacobian) const override {
    jacobian->momentum_q.setZero(D, D);
    jacobian->constraint_q.setZero(N, D);
    using S = Dual<double, (D + 1) / 2 * 2>;
    Config<S> Q;
    for (int k = 0; k < D; ++k) Q(k) = S::Variable(q(k), k);
    if constexpr (!Model::kConstantMass) {
      Mass<S> M;
      Model::MassMatrix(parameters_, Q, &M);
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) {
          for (int k = 0; k < D; ++k) jacobian->momentum_q(i, k) += jump(j) * M(i, j).d[k];
        }
      }
    }
    if constexpr (!Model::kAffineConstraints) {
      const Eigen::Matrix<S, N, D> A = GapJacobian<S>(Q);
      for (int i = 0; i < N; ++i) {
        for (int j = 0; j < D; ++j) {
          for (int k = 0; k < D; ++k) {
            jacobian->momentum_q(j, k) -= impulse(i) * A(i, j).d[k];
            jacobian->constraint_q(i, k) += s(j) * A(i, j).d[k];
          }
        }
      }
    }
  }

 private:
  /// M(q) a − c(q, v) v = M a + Ṁ v − ½ ∂_q(vᵀ M v), from the first derivatives of M; fills M too.
  template <class S>
  Config<S> InertialForce(const Config<S>& q, const Config<S>& v, const Config<S>& a,
                          Mass<S>* M) const {
    using G = Dual<S, D>;
    Config<G> Q;
    for (int k = 0; k < D; ++k) Q(k) = G::Variable(q(k), k);
    Mass<G> MG;
    Model::MassMatrix(parameters_, Q, &MG);
    Config<S> result;
    for (int k = 0; k < D; ++k) result(k) = S(0.0);
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) {
        const G& m = MG(i, j);
        (*M)(i, j) = m.value;
        S rate = S(0.0);
        for (int k = 0; k < D; ++k) rate += m.d[k] * v(k);
        result(i) += m.value * a(j) + rate * v(j);
        const S vv = v(i) * v(j);
        for (int k = 0; k < D; ++k) result(k) -= 0.5 * m.d[k] * vv;
      }
    }
    return result;
  }

  template <class S>
  Eigen::Matrix<S, N, D> GapJacobian(const Config<S>& q) const {
    using G = Dual<S, D>;
    Config<G> Q;
    for (int k = 0; k < D; ++k) Q(k) = G::Variable(q(k), k);
    Gap<G> a;
    Model::Gaps(parameters_, Q, &a);
    Eigen::Matrix<S, N, D> A;
    for (int i = 0; i < N; ++i) {
      for (int k = 0; k < D; ++k) A(i, k) = a(i).d[k];
    }
    return A;
  }

  template <class S>
  Config<S> ConstraintForce(const Config<S>& q, const Gap<S>& lambda) const {
    const Eigen::Matrix<S, N, D> A = GapJacobian<S>(q);
    Config<S> force;
    for (int k = 0; k < D; ++k) {
      force(k) = S(0.0);
      for (int i = 0; i < N; ++i) force(k) += A(i, k) * lambda(i);
    }
    return force;
  }

  /// d²/ds² a(q + s v + ½ s² q̈) at s = 0, that is Da q̈ + D²a(v, v).
  template <class S>
  Gap<S> GapAcceleration(const Config<S>& q, const Config<S>& v, const Config<S>& qdd) const {
    using G = Dual<S, 1>;
    using H = Dual<G, 1>;
    Config<H> Q;
    for (int k = 0; k < D; ++k) {
      Q(k).value.value = q(k);
      Q(k).value.d[0] = v(k);
      Q(k).d[0].value = v(k);
      Q(k).d[0].d[0] = qdd(k);
    }
    Gap<H> a;
    Model::Gaps(parameters_, Q, &a);
    Gap<S> result;
    for (int i = 0; i < N; ++i) result(i) = a(i).d[0].d[0];
    return result;
  }

  typename Model::template Parameters<double> parameters_;
  Mass<double> constant_mass_ = Mass<double>::Identity();
  Eigen::Matrix<double, N, D> constant_jacobian_ = Eigen::Matrix<double, N, D>::Zero();
};

template <class Model>
std::unique_ptr<MechanicalSystem> MakeSystem(const ParameterValues& parameters) {
  return std::make_unique<ModelSystem<Model>>(parameters);
}

}  // namespace contact_flow
