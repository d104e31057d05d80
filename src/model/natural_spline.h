// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/autodiff.h"

namespace contact_flow {

/// The cubic spline through given values at given times with continuous second derivatives, which
/// are zero at both ends. It goes straight on beyond them.
class NaturalSpline {
 public:
  /// Times that rise, two at least, and as many values.
  NaturalSpline(std::vector<double> times, const std::vector<double>& values);

  /// The first time behind t at which the third derivative jumps, or infinity.
  double NextKnot(double t) const;
  /// At t, which may be a Dual.
  template <class S>
  S At(const S& t) const {
    const Piece& p = pieces_[Find(Plain(t))];
    const S s = t - p.begin;
    return p.a[0] + s * (p.a[1] + s * (p.a[2] + s * p.a[3]));
  }

 private:
  /// a₀ + a₁ s + a₂ s² + a₃ s³, s = t − begin.
  struct Piece {
    double begin;
    double a[4];
  };

  static double Plain(double t) { return t; }
  template <class S, int N>
  static double Plain(const Dual<S, N>& t) {
    return Plain(t.value);
  }
  std::size_t Find(double t) const;

  std::vector<double> times_;
  std::vector<Piece> pieces_;  // before the first time, between them, behind the last
};

}  // namespace contact_flow
