// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <type_traits>

#include "contact_flow/autodiff.h"
#include "contact_flow/contact_mode.h"
#include "contact_flow/model/configuration_space.h"
#include "contact_flow/model/model_traits.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {

/// The terms of (1a) and (1b) of a template model at any scalar S, with parameters of type P:
/// double, or Dual<double, 1> to differentiate by one of them.
template <class Model, class P>
class ModelTerms {
 public:
  using Traits = ModelTraits<Model>;
  static constexpr int D = Model::kDof;
  static constexpr int Q = Traits::kPositions;
  /// Gradients, and all rows: those of the tangential maps behind.
  static constexpr int G = Model::kConstraints + Traits::kBilateral;
  static constexpr int N = G + Traits::kTangential;
  static constexpr int U = Model::kInputs;
  static constexpr bool kFlat = Q == D;
  template <class S>
  using Position = Eigen::Matrix<S, Q, 1>;
  template <class S>
  using Velocity = Eigen::Matrix<S, D, 1>;
  template <class S>
  using Input = Eigen::Matrix<S, U, 1>;
  template <class S>
  using Gap = Eigen::Matrix<S, N, 1>;
  template <class S>
  using Mass = Eigen::Matrix<S, D, D>;
  template <class T>
  using Parameters = typename Model::template Parameters<T>;

  ModelTerms(const Parameters<P>& parameters, const ConfigurationSpace& space)
      : parameters_(parameters), space_(space) {}

  template <class S>
  void MassMatrix(const Position<S>& q, Mass<S>* M) const {
    Model::MassMatrix(Lift<S>(), q, M);
  }

  /// f(q, v, u, J), without Coriolis.
  template <class S>
  void Force(const Position<S>& q, const Velocity<S>& v, const Input<S>& u, const ContactMode& mode,
             Velocity<S>* f) const {
    if constexpr (Traits::kContactEffort) {
      Model::Force(Lift<S>(), q, v, u, mode, f);
    } else {
      Model::Force(Lift<S>(), q, v, u, f);
    }
  }

  /// a(q), then b(q), then zeros.
  template <class S>
  void Gaps(const Position<S>& q, Gap<S>* gap) const {
    const auto& p = Lift<S>();
    for (int i = G; i < N; ++i) (*gap)(i) = S(0.0);
    if constexpr (N == Model::kConstraints) {
      Model::Gaps(p, q, gap);
    } else if constexpr (Traits::kBilateral == 0) {
      Eigen::Matrix<S, Model::kConstraints, 1> a;
      Model::Gaps(p, q, &a);
      for (int i = 0; i < Model::kConstraints; ++i) (*gap)(i) = a(i);
    } else {
      Eigen::Matrix<S, Model::kConstraints, 1> a;
      Eigen::Matrix<S, Traits::kBilateral, 1> b;
      Model::Gaps(p, q, &a);
      Model::Closures(p, q, &b);
      for (int i = 0; i < Model::kConstraints; ++i) (*gap)(i) = a(i);
      for (int i = 0; i < Traits::kBilateral; ++i) (*gap)(Model::kConstraints + i) = b(i);
    }
  }

  /// q with its d left-trivialized tangent directions as the first d derivatives.
  template <class T, class S>
  Position<T> Seed(const Position<S>& q) const {
    Position<T> seeded;
    for (int k = 0; k < Q; ++k) seeded(k) = T::Constant(q(k));
    if constexpr (kFlat) {
      for (int k = 0; k < D; ++k) seeded(k).d[k] = S(1.0);
    } else {
      for (int j = 0; j < D; ++j) {
        Velocity<S> unit;
        for (int k = 0; k < D; ++k) unit(k) = S(k == j ? 1.0 : 0.0);
        const Position<S> moved = Rate(q, unit);
        for (int k = 0; k < Q; ++k) seeded(k).d[j] = moved(k);
      }
    }
    return seeded;
  }

  /// M(q) a − c(q, v) v = M a + Ṁ v − ½ ∂_q(vᵀ M v) (+ ω × (M v)_ω), from the first derivatives of
  /// M; fills M too.
  template <class S>
  Velocity<S> InertialForce(const Position<S>& q, const Velocity<S>& v, const Velocity<S>& a,
                            Mass<S>* M) const {
    using G = Dual<S, D>;
    Mass<G> MG;
    MassMatrix<G>(Seed<G>(q), &MG);
    Velocity<S> result, momentum;
    for (int k = 0; k < D; ++k) result(k) = momentum(k) = S(0.0);
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) {
        const G& m = MG(i, j);
        (*M)(i, j) = m.value;
        S rate = S(0.0);
        for (int k = 0; k < D; ++k) rate += m.d[k] * v(k);
        result(i) += m.value * a(j) + rate * v(j);
        const S vv = v(i) * v(j);
        for (int k = 0; k < D; ++k) result(k) -= 0.5 * m.d[k] * vv;
        if constexpr (!kFlat) momentum(i) += m.value * v(j);
      }
    }
    if constexpr (!kFlat) {
      for (const ConfigurationSpace::Rotation& rotation : space_.rotations()) {
        const int x = rotation.v, y = x + 1, z = x + 2;
        result(x) += v(y) * momentum(z) - v(z) * momentum(y);
        result(y) += v(z) * momentum(x) - v(x) * momentum(z);
        result(z) += v(x) * momentum(y) - v(y) * momentum(x);
      }
    }
    return result;
  }

  /// Da(q), Db(q), T(q).
  template <class S>
  Eigen::Matrix<S, N, D> GapJacobian(const Position<S>& q) const {
    using T = Dual<S, D>;
    Gap<T> a;
    Gaps<T>(Seed<T>(q), &a);
    Eigen::Matrix<S, N, D> A;
    for (int i = 0; i < G; ++i) {
      for (int k = 0; k < D; ++k) A(i, k) = a(i).d[k];
    }
    if constexpr (N > G) {
      Velocity<S> zero, unit;
      for (int k = 0; k < D; ++k) zero(k) = unit(k) = S(0.0);
      for (int k = 0; k < D; ++k) {
        unit(k) = S(1.0);
        const Slips<S> s = Slip<S>(q, unit);
        for (int i = G; i < N; ++i) A(i, k) = s(i - G);
        unit(k) = S(0.0);
      }
    }
    return A;
  }

  /// T(q) v.
  template <class S>
  using Slips = Eigen::Matrix<S, N - G, 1>;
  template <class S>
  Slips<S> Slip(const Position<S>& q, const Velocity<S>& v) const {
    Slips<S> s;
    if constexpr (N > G) Model::Slip(Lift<S>(), q, v, &s);
    return s;
  }

  /// Aᵀ λ.
  template <class S>
  Velocity<S> ConstraintForce(const Position<S>& q, const Gap<S>& lambda) const {
    const Eigen::Matrix<S, N, D> A = GapJacobian<S>(q);
    Velocity<S> force;
    for (int k = 0; k < D; ++k) {
      force(k) = S(0.0);
      for (int i = 0; i < N; ++i) force(k) += A(i, k) * lambda(i);
    }
    return force;
  }

  /// A v̇ + Ȧ v: d²/ds² of the gaps along a motion with velocity v and acceleration v̇, and d/ds of
  /// T v.
  template <class S>
  Gap<S> GapAcceleration(const Position<S>& q, const Velocity<S>& v,
                         const Velocity<S>& vdot) const {
    using F = Dual<S, 1>;
    using H = Dual<F, 1>;
    Position<S> first, second;  // q̇, q̈
    if constexpr (kFlat) {
      first = v;
      second = vdot;
    } else {
      first = Rate(q, v);
      Position<F> ahead;
      Velocity<F> faster;
      for (int k = 0; k < Q; ++k) {
        ahead(k).value = q(k);
        ahead(k).d[0] = first(k);
      }
      for (int k = 0; k < D; ++k) {
        faster(k).value = v(k);
        faster(k).d[0] = vdot(k);
      }
      const Position<F> rate = Rate(ahead, faster);
      for (int k = 0; k < Q; ++k) second(k) = rate(k).d[0];
    }
    Position<H> path;
    for (int k = 0; k < Q; ++k) {
      path(k).value.value = q(k);
      path(k).value.d[0] = first(k);
      path(k).d[0].value = first(k);
      path(k).d[0].d[0] = second(k);
    }
    Gap<H> a;
    Gaps<H>(path, &a);
    Gap<S> result;
    for (int i = 0; i < G; ++i) result(i) = a(i).d[0].d[0];
    if constexpr (N > G) {
      Position<F> ahead;
      Velocity<F> faster;
      for (int k = 0; k < Q; ++k) {
        ahead(k).value = q(k);
        ahead(k).d[0] = first(k);
      }
      for (int k = 0; k < D; ++k) {
        faster(k).value = v(k);
        faster(k).d[0] = vdot(k);
      }
      const Slips<F> s = Slip<F>(ahead, faster);
      for (int i = G; i < N; ++i) result(i) = s(i - G).d[0];
    }
    return result;
  }

 private:
  static constexpr int kMaxParameters = 64;

  template <class S>
  Position<S> Rate(const Position<S>& q, const Velocity<S>& v) const {
    Position<S> rate;
    space_.Rate(q.data(), v.data(), rate.data());
    return rate;
  }

  /// A constant of type T ∈ {P, Dual<P, ·>, Dual<Dual<P, ·>, ·>, …}.
  template <class T>
  static T Embed(const P& value) {
    if constexpr (std::is_same_v<T, P>) {
      return value;
    } else {
      return T::Constant(Embed<std::decay_t<decltype(std::declval<T>().value)>>(value));
    }
  }

  /// The parameters for terms at scalar T.
  template <class T>
  decltype(auto) Lift() const {
    if constexpr (std::is_same_v<P, double> || std::is_same_v<P, T>) {
      return (parameters_);
    } else {
      std::array<const P*, kMaxParameters> from;
      int count = 0;
      Parameters<P> source = parameters_;
      source.Visit(
          [&](P& field, const char*, const char*, const char*, Range) { from[count++] = &field; });
      Parameters<T> lifted;
      count = 0;
      lifted.Visit([&](T& field, const char*, const char*, const char*, Range) {
        field = Embed<T>(*from[count++]);
      });
      return lifted;
    }
  }

  const Parameters<P>& parameters_;
  const ConfigurationSpace& space_;
};

}  // namespace contact_flow
