// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>

/// The one automatic-differentiation scalar of the package.
///
/// Eigen::AutoDiffScalar was tried first: three levels of nesting with plain numbers in the
/// expression do not compile, and its lazy results dangle in an `auto`. A Dual is a plain value
/// instead; it is only ever differentiated through residuals, never through a factorization
/// (docs/architecture.md).
namespace contact_flow {

/// A number x = value + Σ_k ε_k d[k] with N directional derivatives over the scalar S, which may
/// itself be a Dual. Comparisons look at the value alone. A default-constructed Dual
/// is uninitialized.
template <class S, int N>
struct Dual {
  S value;
  Eigen::Array<S, N, 1> d;

  Dual() = default;
  /// A constant.
  Dual(double constant) : value(constant) {  // NOLINT(runtime/explicit): numbers mix freely
    d.setConstant(S(0.0));
  }

  /// The variable `value` whose derivative is the k-th unit vector.
  static Dual Variable(const S& value, int k) {
    Dual x = Constant(value);
    x.d[k] = S(1.0);
    return x;
  }
  static Dual Constant(const S& value) {
    Dual x(0.0);
    x.value = value;
    return x;
  }

  Dual& operator+=(const Dual& o) { return *this = *this + o; }
  Dual& operator-=(const Dual& o) { return *this = *this - o; }
  Dual& operator*=(const Dual& o) { return *this = *this * o; }
  Dual& operator/=(const Dual& o) { return *this = *this / o; }

  friend Dual operator-(const Dual& a) {
    Dual r;
    r.value = -a.value;
    r.d = -a.d;
    return r;
  }
  friend Dual operator+(const Dual& a, const Dual& b) {
    Dual r;
    r.value = a.value + b.value;
    r.d = a.d + b.d;
    return r;
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    Dual r;
    r.value = a.value - b.value;
    r.d = a.d - b.d;
    return r;
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    Dual r;
    r.value = a.value * b.value;
    r.d = a.d * b.value + a.value * b.d;
    return r;
  }
  friend Dual operator/(const Dual& a, const Dual& b) {
    Dual r;
    const S inverse = 1.0 / b.value;
    r.value = a.value * inverse;
    r.d = (a.d - r.value * b.d) * inverse;
    return r;
  }

  friend Dual operator+(const Dual& a, double b) {
    Dual r = a;
    r.value = a.value + b;
    return r;
  }
  friend Dual operator+(double a, const Dual& b) { return b + a; }
  friend Dual operator-(const Dual& a, double b) { return a + (-b); }
  friend Dual operator-(double a, const Dual& b) { return -b + a; }
  friend Dual operator*(const Dual& a, double b) {
    Dual r;
    r.value = a.value * b;
    r.d = a.d * b;
    return r;
  }
  friend Dual operator*(double a, const Dual& b) { return b * a; }
  friend Dual operator/(const Dual& a, double b) { return a * (1.0 / b); }
  friend Dual operator/(double a, const Dual& b) {
    return b.Chain(a / b.value, -a / (b.value * b.value));
  }

  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }

  /// g(x), given g and g′ at the value.
  Dual Chain(const S& g, const S& slope) const {
    Dual r;
    r.value = g;
    r.d = slope * d;
    return r;
  }
};

template <class S, int N>
Dual<S, N> sqrt(const Dual<S, N>& x) {
  using std::sqrt;
  const S root = sqrt(x.value);
  return x.Chain(root, 0.5 / root);
}
template <class S, int N>
Dual<S, N> sin(const Dual<S, N>& x) {
  using std::cos;
  using std::sin;
  return x.Chain(sin(x.value), cos(x.value));
}
template <class S, int N>
Dual<S, N> cos(const Dual<S, N>& x) {
  using std::cos;
  using std::sin;
  return x.Chain(cos(x.value), -sin(x.value));
}
template <class S, int N>
Dual<S, N> tan(const Dual<S, N>& x) {
  using std::tan;
  const S t = tan(x.value);
  return x.Chain(t, 1.0 + t * t);
}
template <class S, int N>
Dual<S, N> asin(const Dual<S, N>& x) {
  using std::asin;
  using std::sqrt;
  return x.Chain(asin(x.value), 1.0 / sqrt(1.0 - x.value * x.value));
}
template <class S, int N>
Dual<S, N> acos(const Dual<S, N>& x) {
  using std::acos;
  using std::sqrt;
  return x.Chain(acos(x.value), -1.0 / sqrt(1.0 - x.value * x.value));
}
template <class S, int N>
Dual<S, N> atan(const Dual<S, N>& x) {
  using std::atan;
  return x.Chain(atan(x.value), 1.0 / (1.0 + x.value * x.value));
}
template <class S, int N>
Dual<S, N> exp(const Dual<S, N>& x) {
  using std::exp;
  const S e = exp(x.value);
  return x.Chain(e, e);
}
template <class S, int N>
Dual<S, N> log(const Dual<S, N>& x) {
  using std::log;
  return x.Chain(log(x.value), 1.0 / x.value);
}
template <class S, int N>
Dual<S, N> tanh(const Dual<S, N>& x) {
  using std::tanh;
  const S t = tanh(x.value);
  return x.Chain(t, 1.0 - t * t);
}

}  // namespace contact_flow
