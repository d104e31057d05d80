// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <vector>

#include "contact_flow/autodiff.h"
#include "contact_flow/model/make_system.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/model_terms.h"
#include "contact_flow/model/model_traits.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// A MechanicalSystem from a model written once as templates. `Model` provides (see
/// model/example/soft_biped.h):
///   kName, kSummary                                    what it is
///   kDof, kConstraints, kInputs                        d, n, m
///   kConstantMass, kAffineConstraints                  promises that save work
///   kCoordinates, kUnits, kConstraintNames, kInputNames   names, arrays of const char*
///   Parameters, a struct template over the scalar       with Visit(visitor) over all of them
///   MassMatrix(p, q, M)    M(q), full and symmetric    [d×d]
///   Force(p, q, v, u, f)   f(q, v, u), no Coriolis     [d]
///   Gaps(p, q, a)          a(q)                        [n]
///   Restitution(p, i)      γ_i
///   Nominal(p)             the run of a user who asks for nothing in particular
/// and, where Sec. 6.1 is needed:
///   kPositions, Space(), kVelocities   nq > d, Q, and names of velocities (falling_box.h)
///   kBilateral, kBilateralNames, Closures(p, q, b)   l and b(q) [l] (jointed_biped.h)
///   kContactEffort, Force(p, q, v, u, J, f)          an effort that depends on the contact mode J
///   Compliant()                                      those that only switch the effort (chair.h)
/// and, for contacts with friction:
///   kSlipDimension         1 in the plane, 2 in space
///   Slip(p, q, v, s)       T(q) v, linear in v, kSlipDimension rows a contact  [r]
///   Friction(p, i)         μ_i, or Friction::kNoSlip
/// Coriolis terms, constraint Jacobians and all derivatives follow by automatic differentiation.
template <class Model>
class ModelSystem final : public MechanicalSystem {
  using Traits = ModelTraits<Model>;
  using Terms = ModelTerms<Model, double>;
  static constexpr int D = Terms::D;
  static constexpr int Q = Terms::Q;
  static constexpr int N = Terms::N;
  static constexpr int U = Terms::U;
  template <class S>
  using Position = typename Terms::template Position<S>;
  template <class S>
  using Velocity = typename Terms::template Velocity<S>;
  template <class S>
  using Input = typename Terms::template Input<S>;
  template <class S>
  using Gap = typename Terms::template Gap<S>;
  template <class S>
  using Mass = typename Terms::template Mass<S>;
  /// Directions (δq, δv, δu) of the first derivatives, padded to a whole number of SIMD lanes.
  static constexpr int kDirections = (2 * D + U + 1) / 2 * 2;
  /// A parameter with one derivative.
  using Varied = Dual<double, 1>;

 public:
  /// From values of its parameters; see ModelFactory.
  explicit ModelSystem(const ParameterValues& values) {
    description_.name = Model::kName;
    description_.summary = Model::kSummary;
    description_.coordinates.assign(Model::kCoordinates.begin(), Model::kCoordinates.end());
    description_.units.assign(Model::kUnits.begin(), Model::kUnits.end());
    description_.constraints.assign(Model::kConstraintNames.begin(), Model::kConstraintNames.end());
    description_.inputs.assign(Model::kInputNames.begin(), Model::kInputNames.end());
    description_.parameters = ReadParameters(Model::kName, values, &parameters_);
    if constexpr (Q == D) {
      description_.velocities = description_.coordinates;
    } else {
      description_.velocities.assign(Model::kVelocities.begin(), Model::kVelocities.end());
    }
    if constexpr (Traits::kBilateral > 0) {
      description_.bilateral.assign(Model::kBilateralNames.begin(), Model::kBilateralNames.end());
    }
    space_ = Traits::Space();
    compliant_ = Traits::Compliant();
    contact_effort_ = Traits::kContactEffort;
    restitution_.resize(Model::kConstraints);
    for (int i = 0; i < Model::kConstraints; ++i) {
      restitution_(i) = Model::Restitution(parameters_, i);
    }
    nominal_ = Model::Nominal(parameters_);
    if constexpr (Traits::kTangential > 0) {
      num_tangential_ = Traits::kTangential;
      for (int i = 0; i < Model::kConstraints; ++i) {
        friction_.push_back({Model::Friction(parameters_, i), Terms::G + i * Model::kSlipDimension,
                             Model::kSlipDimension});
      }
    }
    const Position<double> origin = nominal_.x.template head<Q>();
    if (Model::kConstantMass) terms_.template MassMatrix<double>(origin, &constant_mass_);
    if (Model::kAffineConstraints) {
      constant_jacobian_ = terms_.template GapJacobian<double>(origin);
    }
  }

  ModelSystem(const ModelSystem&) = delete;  // terms_ refers to members
  ModelSystem& operator=(const ModelSystem&) = delete;

  bool HasConstantMass() const override { return Model::kConstantMass && Terms::kFlat; }
  bool HasAffineConstraints() const override { return Model::kAffineConstraints; }

  void Dynamics(const VectorRef& q_in, const VectorRef& v_in, const VectorRef& u_in,
                const ContactMode& mode, Matrix* mass, Vector* force) const override {
    const Position<double> q = q_in;
    const Velocity<double> v = v_in;
    const Input<double> u = u_in;
    Velocity<double> f;
    terms_.template Force<double>(q, v, u, mode, &f);
    if constexpr (Model::kConstantMass && Terms::kFlat) {
      if (mass != nullptr) *mass = constant_mass_;
    } else {
      Mass<double> M;
      const Velocity<double> zero = Velocity<double>::Zero();
      f -= terms_.template InertialForce<double>(q, v, zero, &M);
      if (mass != nullptr) *mass = M;
    }
    *force = f;
  }

  void Constraints(const VectorRef& q_in, const VectorRef& v_in,
                   ConstraintTerms* terms) const override {
    const Position<double> q = q_in;
    Gap<double> a;
    terms_.template Gaps<double>(q, &a);
    terms->gap = a;
    if constexpr (Model::kAffineConstraints) {
      terms->jacobian = constant_jacobian_;
      terms->bias.setZero(N);
    } else {
      const Velocity<double> v = v_in, zero = Velocity<double>::Zero();
      terms->jacobian = terms_.template GapJacobian<double>(q);
      terms->bias = terms_.template GapAcceleration<double>(q, v, zero);
    }
  }

  void DifferentiateDynamics(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                             const ContactMode& mode, const VectorRef& acceleration,
                             const VectorRef& force, ResidualJacobian* jacobian) const override {
    using S = Dual<double, kDirections>;
    const Position<double> at = q;
    const Position<S> X = terms_.template Seed<S>(at);
    Velocity<S> V, a;
    Input<S> W;
    Gap<S> lambda;
    for (int k = 0; k < D; ++k) {
      V(k) = S::Variable(v(k), D + k);
      a(k) = S::Constant(acceleration(k));
    }
    for (int k = 0; k < U; ++k) W(k) = S::Variable(u(k), 2 * D + k);
    for (int i = 0; i < N; ++i) lambda(i) = S::Constant(force(i));
    Velocity<S> r1;
    terms_.template Force<S>(X, V, W, mode, &r1);
    for (int k = 0; k < D; ++k) r1(k) = -r1(k);
    if constexpr (!(Model::kConstantMass && Terms::kFlat)) {
      Mass<S> M;
      const Velocity<S> inertial = terms_.template InertialForce<S>(X, V, a, &M);
      for (int k = 0; k < D; ++k) r1(k) += inertial(k);
    }
    if constexpr (!Model::kAffineConstraints) {
      const Velocity<S> push = terms_.template ConstraintForce<S>(X, lambda);
      for (int k = 0; k < D; ++k) r1(k) -= push(k);
      const Gap<S> r2 = terms_.template GapAcceleration<S>(X, V, a);
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
    const Position<double> at = q;
    const Position<S> X = terms_.template Seed<S>(at);
    if constexpr (!Model::kConstantMass) {
      Mass<S> M;
      terms_.template MassMatrix<S>(X, &M);
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) {
          for (int k = 0; k < D; ++k) jacobian->momentum_q(i, k) += jump(j) * M(i, j).d[k];
        }
      }
    }
    if constexpr (!Model::kAffineConstraints) {
      const Eigen::Matrix<S, N, D> A = terms_.template GapJacobian<S>(X);
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

  void DifferentiateDynamicsByParameters(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                                         const ContactMode& mode, const VectorRef& acceleration,
                                         const VectorRef& force, const std::vector<int>& parameters,
                                         ParameterJacobian* jacobian) const override {
    const Position<Varied> X = Constants<Q>(q);
    const Velocity<Varied> V = Constants<D>(v), a = Constants<D>(acceleration);
    const Input<Varied> W = Constants<U>(u);
    const Gap<Varied> lambda = Constants<N>(force);
    const int count = static_cast<int>(parameters.size());
    jacobian->momentum.resize(D, count);
    jacobian->constraint.resize(N, count);
    for (int c = 0; c < count; ++c) {
      const auto varied = Vary(parameters[c]);
      const ModelTerms<Model, Varied> terms(varied, space_);
      Velocity<Varied> f;
      terms.template Force<Varied>(X, V, W, mode, &f);
      Mass<Varied> M;
      const Velocity<Varied> inertial = terms.template InertialForce<Varied>(X, V, a, &M);
      const Velocity<Varied> push = terms.template ConstraintForce<Varied>(X, lambda);
      const Gap<Varied> r2 = terms.template GapAcceleration<Varied>(X, V, a);
      for (int k = 0; k < D; ++k) {
        jacobian->momentum(k, c) = inertial(k).d[0] - f(k).d[0] - push(k).d[0];
      }
      for (int i = 0; i < N; ++i) jacobian->constraint(i, c) = r2(i).d[0];
    }
  }

  void DifferentiateImpactByParameters(const VectorRef& q, const VectorRef& jump,
                                       const VectorRef& impulse, const VectorRef& s,
                                       const std::vector<int>& parameters,
                                       ParameterJacobian* jacobian) const override {
    const Position<Varied> X = Constants<Q>(q);
    const Gap<Varied> p = Constants<N>(impulse);
    const int count = static_cast<int>(parameters.size());
    jacobian->momentum.setZero(D, count);
    jacobian->constraint.setZero(N, count);
    jacobian->gap.resize(N, count);
    jacobian->restitution.resize(Model::kConstraints, count);
    for (int c = 0; c < count; ++c) {
      const auto varied = Vary(parameters[c]);
      const ModelTerms<Model, Varied> terms(varied, space_);
      Mass<Varied> M;
      terms.template MassMatrix<Varied>(X, &M);
      const Eigen::Matrix<Varied, N, D> A = terms.template GapJacobian<Varied>(X);
      const Velocity<Varied> push = terms.template ConstraintForce<Varied>(X, p);
      Gap<Varied> gap;
      terms.template Gaps<Varied>(X, &gap);
      for (int k = 0; k < D; ++k) {
        for (int j = 0; j < D; ++j) jacobian->momentum(k, c) += M(k, j).d[0] * jump(j);
        jacobian->momentum(k, c) -= push(k).d[0];
      }
      for (int i = 0; i < N; ++i) {
        for (int j = 0; j < D; ++j) jacobian->constraint(i, c) += A(i, j).d[0] * s(j);
        jacobian->gap(i, c) = gap(i).d[0];
      }
      for (int i = 0; i < Model::kConstraints; ++i) {
        jacobian->restitution(i, c) = Varied(Model::Restitution(varied, i)).d[0];
      }
    }
  }

  Matrix DifferentiateFriction(const std::vector<int>& parameters) const override {
    Matrix by = Matrix::Zero(Model::kConstraints, static_cast<Eigen::Index>(parameters.size()));
    if constexpr (Traits::kTangential > 0) {
      for (Eigen::Index c = 0; c < by.cols(); ++c) {
        const auto varied = Vary(parameters[static_cast<std::size_t>(c)]);
        for (int i = 0; i < Model::kConstraints; ++i) {
          by(i, c) = Varied(Model::Friction(varied, i)).d[0];
        }
      }
    }
    return by;
  }

 private:
  template <int Size>
  static Eigen::Matrix<Varied, Size, 1> Constants(const VectorRef& values) {
    Eigen::Matrix<Varied, Size, 1> constants;
    for (int k = 0; k < Size; ++k) constants(k) = Varied::Constant(values(k));
    return constants;
  }

  /// The parameters, with the derivative along the one of this index.
  typename Model::template Parameters<Varied> Vary(int index) const {
    typename Model::template Parameters<Varied> varied;
    int k = 0;
    varied.Visit([&](Varied& field, const char*, const char*, const char*, Range) {
      field = Varied::Constant(description_.parameters[k].value);
      field.d[0] = k == index ? 1 : 0;
      ++k;
    });
    return varied;
  }

  typename Model::template Parameters<double> parameters_;
  const Terms terms_{parameters_, space_};
  Mass<double> constant_mass_ = Mass<double>::Identity();
  Eigen::Matrix<double, N, D> constant_jacobian_ = Eigen::Matrix<double, N, D>::Zero();
};

template <class Model>
std::unique_ptr<MechanicalSystem> MakeSystem(const ParameterValues& parameters) {
  return std::make_unique<ModelSystem<Model>>(parameters);
}

}  // namespace contact_flow
