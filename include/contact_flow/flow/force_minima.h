// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "contact_flow/flow/stage_places.h"

namespace contact_flow {

/// The smallest minimum of the forces of a run, as it goes on: of each guard that is a function of
/// forces the values at the nodes of every step, and on both sides of what makes it jump. So a
/// minimum counts wherever it lies: inside a step, where two steps meet, at a corner of the forces,
/// and beside a jump. Where a guard begins and ends is no minimum.
class ForceMinima {
 public:
  using Values = std::array<double, StagePlaces::kNodes>;
  /// What a force jumps by where another one is let go that is zero only nearly.
  static constexpr double kForceNoise = 1e-6;

  explicit ForceMinima(int guards) : guards_(static_cast<std::size_t>(guards)) {}

  /// A step of these places, in which guard g has these values at the nodes. Changes below
  /// kForceNoise of it are none, nor are those below `relative_noise` of the largest guard so far.
  void Pass(int g, const StagePlaces& places, const Values& values, double relative_noise);
  /// An arc begins. Guards that are not in this set are no longer followed.
  void BeginArc(const ConstraintSet& guards) {
    for (std::size_t g = 0; g < guards_.size(); ++g) {
      guards_[g].begins = true;
      if (!guards.Contains(static_cast<int>(g))) guards_[g].way = Way::kNone;
    }
  }

  double lowest() const { return lowest_; }

 private:
  enum class Way { kNone, kRises, kFalls };  // the first: not followed
  struct Guard {
    Way way = Way::kNone;
    bool begins = true;  // the next step is the first of its arc
    double extreme = 0;  // the lowest since it falls, or the highest since it rises
  };

  std::vector<Guard> guards_;
  double largest_ = 0;  // that a guard of any step began with
  double lowest_ = std::numeric_limits<double>::infinity();
};

}  // namespace contact_flow
