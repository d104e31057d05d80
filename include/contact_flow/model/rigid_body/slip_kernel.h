// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <type_traits>

#include "contact_flow/autodiff.h"
#include "contact_flow/model/rigid_body/constraint/brake.h"
#include "contact_flow/model/rigid_body/constraint/touch.h"
#include "contact_flow/model/rigid_body/element_parts.h"

namespace contact_flow {

/// How a constraint slips: T v with as many rows as the contact has tangential directions.
struct SlipFrame {
  int rows = 0;  ///< 0: no friction, 1: all that moves the contact stays in a plane, 2: in space
  /// One row: the normal m of that plane. The tangent is along m × n.
  Vec3<double> plane = Vec3<double>::Zero();
};

/// Whether a kind needs the table of its parts.
template <class Kind, class = void>
struct HasTable : std::false_type {};
template <class Kind>
struct HasTable<Kind, std::void_t<decltype(Kind::kTable)>> : std::true_type {};

/// Where a kind touches.
template <class Kind, class S>
constraint::Touch<S> TouchOf(const ElementParts& parts, const S* number, const S* z) {
  if constexpr (HasTable<Kind>::value) {
    return Kind::At(*parts.heights, number, z);
  } else {
    return Kind::At(number, z);
  }
}

/// The slip velocity of a kind of constraint that touches, s = W(z) ż, and its derivatives, at z
/// and ż as in ElementParts with the tips and turns that friction adds [M]. `Kind` provides (see
/// constraint/plane.h):
///   kSlipAffine                      W is constant
///   kOther                           the point that gives the other body's place, −1: the world
///   kTips                            points that friction adds; if any, Tip(parts)
///   kTurns                           bodies whose angular velocity is felt: of the first point, of
///                                    the other
///   At(number, z)                    where it touches
///   Tangents(z, touch, first, second)   two directions in space, orthonormal and across the normal
/// s is the velocity of the material of the first body at the contact less that of the other,
///   w = ṗ + ω × arm − (ȯ + ω_o × (p + arm − o)),
/// along the tangents, times Touch::stretch.
template <class Kind>
struct SlipKernel {
  static constexpr int Z = 3 * (Kind::kPoints + Kind::kTips);  // what W may depend on
  static constexpr int M = Z + 3 * Kind::kTurns;
  static constexpr int kRows = 2;

  /// s [rows], at numbers of any scalar.
  template <class S>
  static void Slip(const SlipFrame& frame, const ElementParts& parts, const S* number, const S* z,
                   const S* rate, S* slip) {
    const constraint::Touch<S> touch = TouchOf<Kind>(parts, number, z);
    Vec3<S> tangent[kRows];
    Tangents(frame, z, touch, tangent);
    const Vec3<S> w = Velocity(touch, z, rate);
    for (int r = 0; r < frame.rows; ++r) slip[r] = touch.stretch * Dot(tangent[r], w);
  }

  /// W [rows×M], row-major: s at the unit vectors.
  static void Map(const SlipFrame& frame, const ElementParts& parts, const double* z, double* map) {
    const constraint::Touch<double> touch = TouchOf<Kind>(parts, Numbers<double>(parts).data(), z);
    Vec3<double> tangent[kRows];
    Tangents(frame, z, touch, tangent);
    double rate[M] = {};
    for (int k = 0; k < M; ++k) {
      rate[k] = 1;
      const Vec3<double> w = Velocity(touch, z, rate);
      rate[k] = 0;
      for (int r = 0; r < frame.rows; ++r) map[r * M + k] = touch.stretch * Dot(tangent[r], w);
    }
  }

  /// ṡ [rows].
  static void Rate(const SlipFrame& frame, const ElementParts& parts, const double* z,
                   const double* rate, const double* acceleration, double* slip_rate) {
    if constexpr (Kind::kSlipAffine) {
      Slip(frame, parts, Numbers<double>(parts).data(), z, acceleration, slip_rate);
      return;
    }
    using S = Dual<double, 1>;
    std::array<S, M> at, along;
    for (int k = 0; k < M; ++k) {
      at[k] = S(z[k]);
      along[k] = S(rate[k]);
      at[k].d[0] = k < Z ? rate[k] : 0;
      along[k].d[0] = acceleration[k];
    }
    S slip[kRows];
    Slip(frame, parts, Numbers<S>(parts).data(), at.data(), along.data(), slip);
    for (int r = 0; r < frame.rows; ++r) slip_rate[r] = slip[r].d[0];
  }

  /// ∂(Wᵀλ)/∂z [M×M], column-major.
  static void Hessian(const SlipFrame& frame, const ElementParts& parts, const double* z,
                      const double* lambda, double* hessian) {
    for (int k = 0; k < M * M; ++k) hessian[k] = 0;
    if constexpr (!Kind::kSlipAffine) {
      using B = Dual<double, Z>;
      using S = Dual<B, M>;
      std::array<S, M> at, rate;
      for (int k = 0; k < M; ++k) {
        at[k] = S::Constant(k < Z ? B::Variable(z[k], k) : B(0.0));
        rate[k] = S::Variable(B(0.0), k);
      }
      S slip[kRows];
      Slip(frame, parts, Numbers<S>(parts).data(), at.data(), rate.data(), slip);
      for (int r = 0; r < frame.rows; ++r) {
        for (int j = 0; j < M; ++j) {
          for (int k = 0; k < Z; ++k) hessian[j + k * M] += lambda[r] * slip[r].d[j].d[k];
        }
      }
    }
  }

  /// ∂ṡ/∂z and ∂ṡ/∂ż at fixed z̈, and ∂s/∂z, all [rows×M] row-major.
  static void Differentiate(const SlipFrame& frame, const ElementParts& parts, const double* z,
                            const double* rate, const double* acceleration, double* rate_z,
                            double* rate_rate, double* slip_z) {
    for (int k = 0; k < frame.rows * M; ++k) rate_z[k] = rate_rate[k] = slip_z[k] = 0;
    if constexpr (!Kind::kSlipAffine) {
      using C = Dual<double, Z + M>;
      using S = Dual<C, 1>;
      std::array<S, M> at, along;
      for (int k = 0; k < M; ++k) {
        const C speed = C::Variable(rate[k], Z + k);
        at[k].value = k < Z ? C::Variable(z[k], k) : C(0.0);
        at[k].d[0] = k < Z ? speed : C(0.0);
        along[k].value = speed;
        along[k].d[0] = C(acceleration[k]);
      }
      S slip[kRows];
      Slip(frame, parts, Numbers<S>(parts).data(), at.data(), along.data(), slip);
      for (int r = 0; r < frame.rows; ++r) {
        for (int k = 0; k < M; ++k) {
          rate_rate[r * M + k] = slip[r].d[0].d[Z + k];
          if (k >= Z) continue;
          rate_z[r * M + k] = slip[r].d[0].d[k];
          slip_z[r * M + k] = slip[r].value.d[k];
        }
      }
    }
  }

  /// Derivatives by number k: of W [rows×M] row-major, and of ṡ [rows].
  static void ByNumber(const SlipFrame& frame, const ElementParts& parts, const double* z,
                       const double* rate, const double* acceleration, int number, double* map,
                       double* slip_rate) {
    using B = Dual<double, 1>;
    using S = Dual<B, M>;
    using A = Dual<B, 1>;
    std::array<S, M> at, unit;
    std::array<A, M> path, along;
    for (int k = 0; k < M; ++k) {
      at[k] = S(z[k]);
      unit[k] = S::Variable(B(0.0), k);
      path[k] = A(z[k]);
      along[k] = A(rate[k]);
      path[k].d[0] = B(k < Z ? rate[k] : 0);
      along[k].d[0] = B(acceleration[k]);
    }
    auto numbers = Numbers<S>(parts);
    numbers[number].value.d[0] = 1;
    auto path_numbers = Numbers<A>(parts);
    path_numbers[number].value.d[0] = 1;
    S slip[kRows];
    A moving[kRows];
    Slip(frame, parts, numbers.data(), at.data(), unit.data(), slip);
    Slip(frame, parts, path_numbers.data(), path.data(), along.data(), moving);
    for (int r = 0; r < frame.rows; ++r) {
      for (int k = 0; k < M; ++k) map[r * M + k] = slip[r].d[k].d[0];
      slip_rate[r] = moving[r].d[0].d[0];
    }
  }

 private:
  /// The tangents of the frame, of length 1.
  template <class S>
  static void Tangents(const SlipFrame& frame, const S* z, const constraint::Touch<S>& touch,
                       Vec3<S>* tangent) {
    using std::sqrt;
    if (frame.rows != 1) return Kind::Tangents(z, touch, &tangent[0], &tangent[1]);
    const Vec3<double>& m = frame.plane;
    const Vec3<S>& n = touch.normal;
    const Vec3<S> t(n(2) * m(1) - n(1) * m(2), n(0) * m(2) - n(2) * m(0),
                    n(1) * m(0) - n(0) * m(1));
    const S length = sqrt(Dot(t, t));
    for (int k = 0; k < 3; ++k) tangent[0](k) = t(k) / length;
  }
  /// w, the velocity of the material of the first body there less that of the other.
  template <class S>
  static Vec3<S> Velocity(const constraint::Touch<S>& touch, const S* z, const S* rate) {
    Vec3<S> w = At(rate);
    if constexpr (Kind::kTurns > 0) w += Cross(At(rate + Z), touch.arm);
    if constexpr (Kind::kOther >= 0) {
      constexpr int o = 3 * Kind::kOther;
      const Vec3<S> arm = At(z) + touch.arm - At(z + o);
      w -= At(rate + o) + Cross(At(rate + Z + 3), arm);
    }
    return w;
  }
  template <class S>
  static Vec3<S> At(const S* numbers) {
    return Vec3<S>(numbers[0], numbers[1], numbers[2]);
  }
  template <class S>
  static std::array<S, Kind::kNumbers + 1> Numbers(const ElementParts& parts) {
    std::array<S, Kind::kNumbers + 1> numbers;
    for (int k = 0; k < Kind::kNumbers; ++k) numbers[k] = S(parts.numbers[k].value);
    return numbers;
  }
};

/// The first joint of a brake slips: s = q̇, W = (1, 0).
template <>
struct SlipKernel<constraint::Brake> {
  static constexpr int M = 2;

  static void Map(const SlipFrame&, const ElementParts&, const double*, double* map) {
    map[0] = 1;
    map[1] = 0;
  }
  static void Rate(const SlipFrame&, const ElementParts&, const double*, const double*,
                   const double* acceleration, double* slip_rate) {
    slip_rate[0] = acceleration[0];
  }
  static void Hessian(const SlipFrame&, const ElementParts&, const double*, const double*,
                      double* hessian) {
    std::fill_n(hessian, M * M, 0.);
  }
  static void Differentiate(const SlipFrame&, const ElementParts&, const double*, const double*,
                            const double*, double* rate_z, double* rate_rate, double* slip_z) {
    for (double* rows : {rate_z, rate_rate, slip_z}) std::fill_n(rows, M, 0.);
  }
  static void ByNumber(const SlipFrame&, const ElementParts&, const double*, const double*,
                       const double*, int, double* map, double* slip_rate) {
    std::fill_n(map, M, 0.);
    slip_rate[0] = 0;
  }
};

}  // namespace contact_flow
