// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cmath>

/// To be included by the files alone that are compiled for one instruction set: unnamed namespaces
/// keep what they make of templates apart from what all machines run.
namespace contact_flow {
namespace {

template <int W>
struct LaneVector;
template <>
struct LaneVector<4> {
  typedef double Type __attribute__((vector_size(32)));
  typedef long long Bits __attribute__((vector_size(32)));
};
template <>
struct LaneVector<8> {
  typedef double Type __attribute__((vector_size(64)));
  typedef long long Bits __attribute__((vector_size(64)));
};

/// W numbers, one of each lane. Each operation is that of double, lane by lane, and rounded as it.
template <int W>
struct LaneNumber {
  using Numbers = typename LaneVector<W>::Type;
  using Bits = typename LaneVector<W>::Bits;
  Numbers r;

  LaneNumber() = default;
  LaneNumber(double all) : r(all - Numbers{}) {}  // NOLINT(runtime/explicit): numbers mix freely
  explicit LaneNumber(const Numbers& numbers) : r(numbers) {}

  LaneNumber& operator+=(const LaneNumber& o) { return *this = *this + o; }
  LaneNumber& operator-=(const LaneNumber& o) { return *this = *this - o; }
  LaneNumber& operator*=(const LaneNumber& o) { return *this = *this * o; }
  LaneNumber& operator/=(const LaneNumber& o) { return *this = *this / o; }

  friend LaneNumber operator-(const LaneNumber& a) { return LaneNumber(-a.r); }
  friend LaneNumber operator+(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(a.r + b.r);
  }
  friend LaneNumber operator-(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(a.r - b.r);
  }
  friend LaneNumber operator*(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(a.r * b.r);
  }
  friend LaneNumber operator/(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(a.r / b.r);
  }

  /// f of each lane, written out: sine and cosine of a number are one call.
  template <class Function>
  static LaneNumber Each(const LaneNumber& a, Function&& f) {
    if constexpr (W == 4) {
      return LaneNumber(Numbers{f(a.r[0]), f(a.r[1]), f(a.r[2]), f(a.r[3])});
    } else {
      return LaneNumber(Numbers{f(a.r[0]), f(a.r[1]), f(a.r[2]), f(a.r[3]), f(a.r[4]), f(a.r[5]),
                                f(a.r[6]), f(a.r[7])});
    }
  }
  friend LaneNumber sqrt(const LaneNumber& a) {
    return Each(a, [](double x) { return std::sqrt(x); });
  }
  friend LaneNumber abs(const LaneNumber& a) {
    return LaneNumber(Numbers(Bits(a.r) & (Bits{} + 0x7fffffffffffffff)));
  }
  // By the library: its bits.
  friend LaneNumber sin(const LaneNumber& a) {
    return Each(a, [](double x) { return std::sin(x); });
  }
  friend LaneNumber cos(const LaneNumber& a) {
    return Each(a, [](double x) { return std::cos(x); });
  }
  friend LaneNumber tanh(const LaneNumber& a) {
    return Each(a, [](double x) { return std::tanh(x); });
  }
  friend LaneNumber exp(const LaneNumber& a) {
    return Each(a, [](double x) { return std::exp(x); });
  }
  /// As std::min: b where b < a.
  friend LaneNumber min(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(Numbers(b.r < a.r ? b.r : a.r));
  }
  /// a where the choice is not 0, b elsewhere.
  friend LaneNumber Where(const LaneNumber& choice, const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(Numbers(choice.r != 0 ? a.r : b.r));
  }
  /// As std::max: b where a < b.
  friend LaneNumber max(const LaneNumber& a, const LaneNumber& b) {
    return LaneNumber(Numbers(a.r < b.r ? b.r : a.r));
  }
};

}  // namespace
}  // namespace contact_flow

namespace Eigen {
template <int W>
struct NumTraits<contact_flow::LaneNumber<W>> : GenericNumTraits<contact_flow::LaneNumber<W>> {
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
}  // namespace Eigen
