// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/autodiff.h"

namespace contact_flow {

/// r(t) through given values at given times.
///
///   linear  straight between them; before the first time the first line goes on, behind the last
///           time the last value holds. ṙ jumps at all times but the first: its switches.
///   cubic   the spline with continuous r̈, at rest at both ends; outside, the end values hold.
///   blended straight, with ṙ led from each line to the next at a constant rate within b/2 of the
///           time between them, where r misses the value by |Δṙ| b/8; at rest at both ends, at
///           their values, from where ṙ is led within b; outside, the end values hold. (J. J.
///           Craig, Introduction to Robotics: linear functions with parabolic blends.)
///   cubic or blended, periodic   the same with r(t + period) = r(t), the last value being the
///           first again; a blended one is led through its ends like through other times.
class TimeFunction {
 public:
  enum class Kind { kLinear, kCubic, kBlended };
  /// "linear", "cubic", "blended".
  static const std::vector<std::string>& KindNames();

  /// Throws std::invalid_argument where times do not rise, numbers are missing or not finite, a
  /// periodic one does not end where it begins, blends [s] overlap, and for linear ones that are
  /// periodic, which would have a switch at each time of each period.
  TimeFunction(Kind kind, std::vector<double> times, std::vector<double> values, bool periodic,
               double blend = 0);

  Kind kind() const { return kind_; }
  bool periodic() const { return periodic_; }
  /// Where it begins to repeat itself, less where it begins [s].
  double period() const { return times_.back() - times_.front(); }
  /// Instants at which ṙ jumps, ascending: of linear ones, all but the first.
  std::vector<double> Switches() const;

  /// The first time behind t at which r̈ or r⃛ jumps; infinity for linear ones, and behind the last.
  double NextKnot(double t) const;

  /// r and ṙ at t, which may be a Dual. Of linear ones `passed` says how many switches lie behind.
  template <class S>
  void At(const S& t, int passed, S* value, S* rate) const {
    S s = t;
    const int k = Place(Plain(t), passed, &s);
    const Piece& p = pieces_[k];
    *value = p.a[0] + s * (p.a[1] + s * (p.a[2] + s * p.a[3]));
    *rate = p.a[1] + s * (2 * p.a[2] + s * (3 * p.a[3]));
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
  /// The piece of t, and s.
  template <class S>
  int Place(double t, int passed, S* s) const {
    const double lap = Laps(t) * period();
    const int k = kind_ == Kind::kLinear ? passed : Find(t - lap);
    *s = *s - (pieces_[k].begin + lap);
    return k;
  }
  double Laps(double t) const;
  int Find(double t) const;
  void Spline();
  void Blend(double b);

  Kind kind_;
  std::vector<double> times_, values_;
  bool periodic_;
  /// Of a linear one those between the times, and the last value. Of others the first value, those
  /// between the knots, and the last value.
  std::vector<Piece> pieces_;
  std::vector<double> knots_;  // between the pieces of those that are not linear
};

}  // namespace contact_flow
