// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <functional>
#include <limits>

#include "contact_flow/constraint_set.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The first event inside a step, if any.
struct LocatedEvent {
  bool found = false;
  /// Place of the event in the step, [0, 1]. Without an event: how far into the step every guard is
  /// resolved; where that is less than 1, the step must be repeated with this part of its length,
  /// and `constraint` is a guard that is too quick for the whole.
  double theta = 1;
  int constraint = -1;  ///< a gap that closes (i ∉ J) or a force that vanishes (i ∈ J)
  bool touch = false;   ///< the gap reaches zero and opens again: grazing
  /// What the next step may be longer by, for the guards' sake.
  double growth = std::numeric_limits<double>::infinity();
};

/// What is searched, and how closely.
struct GuardQuery {
  ConstraintSet guards;
  const double* floor;  ///< [n] what cannot be told from zero, of each guard
  bool touches;         ///< whether a guard that reaches zero and opens again is an event
  bool quick;           ///< whether the guards may be quicker than the pieces are short
  int pieces;           ///< that the step is divided into, to begin with
  int max_samples;
  bool quick_values = false;  ///< whether values alone cost less, by the sampler of values
  /// Those that go on below −floor behind the step, if they are below zero at its end.
  ConstraintSet falling = {};
  /// Those that have not been above their floors: their dips count only in steps that begin there.
  /// Of gaps that begin below −floor only what falls further counts.
  ConstraintSet low = {};
  /// Of those, too, a zero counts that is passed by more than this, d/dθ: they have come back.
  double fall = std::numeric_limits<double>::infinity();
};

/// Finds the earliest zero of some guards along a step, θ ∈ [0, 1], with guards that may be far
/// quicker than the motion.
///
/// The step is divided into pieces of irregular length, each with the guards' values and rates at
/// both ends and at a point inside, at an irregular place. The cubic Hermite interpolant of the
/// ends is compared with the truth inside, value and rate. That tells its error, and the
/// interpolants of the two halves are nearer yet (16 times, of a smooth guard). A guard whose
/// values and rates so far tell of more than about one oscillation in the piece is not settled;
/// others are settled on the piece
///   if the halves' Bernstein coefficients stay above zero by twice the error: it has no zero; or
///   if the error is small compared with the guard's own variation, and either half turns as
///   its ends tell: then it is searched between the turns, the roots of its true rate.
/// Otherwise the piece is halved. A zero counts only if the guard falls below −floor after it. A
/// guard that comes within ten floors and opens again is a touch.
///
/// So a dip that holds one of the sampled points is found whatever the guard does elsewhere: one
/// that lasts longer than kLargestHole / pieces of the step.
class GuardSearch {
 public:
  /// Largest distance of sampled points, of a piece.
  static constexpr double kLargestHole = 0.65;
  static constexpr int kMaxPieces = 64;  ///< to begin with

  /// Writes value [n] and d/dθ [n] of the guards in `set` at θ.
  using Sampler = std::function<void(double theta, ConstraintSet set, double* value, double* rate)>;

  /// The values alone.
  using Values = std::function<void(double theta, ConstraintSet set, double* value)>;

  GuardSearch(int n, Sampler sampler, Values values = {});

  /// Makes `event` the earliest of what it was and what is found. `margin` becomes the smallest
  /// minimum that was passed and is no event, if it is less.
  void Run(const GuardQuery& query, double* margin, LocatedEvent* event);
  /// The shortest piece of the last run that did not resolve a guard, halved; or 1.
  double finest() const { return finest_; }
  long samples() const { return samples_; }  ///< of the last run

 private:
  struct Node {
    double theta, value, rate;
  };
  Node At(int i, int slot) const { return {theta_[slot], values_(i, slot), rates_(i, slot)}; }
  double Irregular() const;
  void Sample(int slot);
  void Divide(int pieces);
  void Learn(int i, const Node& a, const Node& m, const Node& b);
  bool Settle(int i, int middle, int end, bool last);
  void SearchHalf(int i, const Node& begin, const Node& end, double lower_bound);
  double RateAt(int i, double theta);
  double ValueAt(int i, double theta);
  bool VanishesLater(int i, double left, double right);
  void Report(int i, double theta, bool touch);

  static constexpr int kMaxHalvings = 32;  // a kink is then resolved to rounding
  static constexpr int kSlots = kMaxPieces + kMaxHalvings + 2;

  const Sampler sampler_;
  const Values values_alone_;
  // Slot 0 is the point up to which all is settled; the ends of the pieces that follow are in the
  // slots from the top down to 1. Two last columns are scratch, and
  // the values at the event that was found.
  Matrix values_, rates_;  // [n × slots + 2]
  std::array<double, kSlots> theta_;
  std::array<ConstraintSet, kSlots> open_;  // the guards that are not settled on the piece before
  // How quick guards are, see Learn; how far below −floor those that are low begin.
  enum { kBend, kTurn, kSunk };
  Matrix seen_;  // [n×3]
  double shortest_ = 0;
  double sampled_event_ = -1;  // the θ of the last column
  long samples_ = 0;
  double finest_ = 1;
  const GuardQuery* query_ = nullptr;
  double* margin_ = nullptr;
  LocatedEvent* event_ = nullptr;
};

}  // namespace contact_flow
