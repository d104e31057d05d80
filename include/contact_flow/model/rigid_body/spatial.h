// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// Spatial vector algebra after R. Featherstone, Rigid Body Dynamics Algorithms (Springer 2008),
/// Ch. 2, for any scalar. All vectors of one formula are given in the same axes
/// about the same point.
namespace contact_flow {

template <class S>
using Vec3 = Eigen::Matrix<S, 3, 1>;
template <class S>
using Mat3 = Eigen::Matrix<S, 3, 3>;

/// a × b. (Eigen's own needs its geometry module and conjugates complex numbers in some versions.)
template <class S>
inline Vec3<S> Cross(const Vec3<S>& a, const Vec3<S>& b) {
  return Vec3<S>(a(1) * b(2) - a(2) * b(1), a(2) * b(0) - a(0) * b(2), a(0) * b(1) - a(1) * b(0));
}
/// aᵀ b, without conjugation.
template <class S>
inline S Dot(const Vec3<S>& a, const Vec3<S>& b) {
  return a(0) * b(0) + a(1) * b(1) + a(2) * b(2);
}
template <class S>
inline Vec3<S> Zero3() {
  return Vec3<S>(S(0.0), S(0.0), S(0.0));
}
template <class S>
inline Mat3<S> ZeroMat3() {
  Mat3<S> m;
  for (int k = 0; k < 9; ++k) m(k / 3, k % 3) = S(0.0);
  return m;
}

/// A motion (ω, velocity of the body point at the reference point) or a force (moment about the
/// reference point, force).
template <class S>
struct Spatial {
  Vec3<S> ang;
  Vec3<S> lin;

  static Spatial Zero() { return {Zero3<S>(), Zero3<S>()}; }
  Spatial& operator+=(const Spatial& o) {
    ang += o.ang;
    lin += o.lin;
    return *this;
  }
  Spatial& operator-=(const Spatial& o) {
    ang -= o.ang;
    lin -= o.lin;
    return *this;
  }
  friend Spatial operator+(const Spatial& a, const Spatial& b) {
    return {a.ang + b.ang, a.lin + b.lin};
  }
  friend Spatial operator-(const Spatial& a, const Spatial& b) {
    return {a.ang - b.ang, a.lin - b.lin};
  }
  friend Spatial operator*(const S& s, const Spatial& a) { return {s * a.ang, s * a.lin}; }
};

/// Power of a force on a motion.
template <class S>
inline S Dot(const Spatial<S>& a, const Spatial<S>& b) {
  return a.ang(0) * b.ang(0) + a.ang(1) * b.ang(1) + a.ang(2) * b.ang(2) + a.lin(0) * b.lin(0) +
         a.lin(1) * b.lin(1) + a.lin(2) * b.lin(2);
}
/// v × m (2.31): the rate of a motion m that is fixed in a body moving with v.
template <class S>
inline Spatial<S> CrossMotion(const Spatial<S>& v, const Spatial<S>& m) {
  return {Cross(v.ang, m.ang), Cross(v.ang, m.lin) + Cross(v.lin, m.ang)};
}
/// v ×* f (2.32): the rate of a force f that is fixed in a body moving with v.
template <class S>
inline Spatial<S> CrossForce(const Spatial<S>& v, const Spatial<S>& f) {
  return {Cross(v.ang, f.ang) + Cross(v.lin, f.lin), Cross(v.ang, f.lin)};
}

/// Inertia of a rigid body about the reference point (2.62): mass [kg], first moment m c [kg·m] and
/// rotational inertia [kg·m²], a symmetric matrix.
template <class S>
struct SpatialInertia {
  S mass;
  Vec3<S> moment;
  S xx, xy, xz, yy, yz, zz;

  static SpatialInertia Zero() {
    return {S(0.0), Zero3<S>(), S(0.0), S(0.0), S(0.0), S(0.0), S(0.0), S(0.0)};
  }
  SpatialInertia& operator+=(const SpatialInertia& o) {
    mass += o.mass;
    moment += o.moment;
    xx += o.xx;
    xy += o.xy;
    xz += o.xz;
    yy += o.yy;
    yz += o.yz;
    zz += o.zz;
    return *this;
  }
  /// Ī w
  Vec3<S> Rotational(const Vec3<S>& w) const {
    return Vec3<S>(xx * w(0) + xy * w(1) + xz * w(2), xy * w(0) + yy * w(1) + yz * w(2),
                   xz * w(0) + yz * w(1) + zz * w(2));
  }
  /// Momentum I v.
  Spatial<S> operator*(const Spatial<S>& v) const {
    return {Rotational(v.ang) + Cross(moment, v.lin), mass * v.lin - Cross(moment, v.ang)};
  }
};

/// The inertia, in other axes and about another point, of a body with inertia `central` [kg·m²] (in
/// axes that `rotation` turns) about its centre of mass, which is at `com`: −m [com]²× + R Ī Rᵀ.
template <class S>
inline SpatialInertia<S> PlaceInertia(const S& mass, const Mat3<S>& central,
                                      const Mat3<S>& rotation, const Vec3<S>& com) {
  const Mat3<S> half = rotation * central;
  const auto turned = [&](int i, int j) {
    return half(i, 0) * rotation(j, 0) + half(i, 1) * rotation(j, 1) + half(i, 2) * rotation(j, 2);
  };
  const Vec3<S> h = mass * com;
  const S x = h(0) * com(0), y = h(1) * com(1), z = h(2) * com(2);
  return {mass,
          h,
          turned(0, 0) + y + z,
          turned(0, 1) - h(0) * com(1),
          turned(0, 2) - h(0) * com(2),
          turned(1, 1) + x + z,
          turned(1, 2) - h(1) * com(2),
          turned(2, 2) + x + y};
}

}  // namespace contact_flow
