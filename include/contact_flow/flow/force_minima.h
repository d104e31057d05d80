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

  explicit ForceMinima(int guards)
      : ways_(static_cast<std::size_t>(guards), Way::kNone), extreme_(guards) {}

  /// A step of these places, in which guard g has these values at the nodes. Changes below
  /// kForceNoise of it are none, nor are those below `relative_noise` of the largest guard so far.
  void Pass(int g, const StagePlaces& places, const Values& values, double relative_noise);
  /// Behind a transition: guards that are not in this set are no longer followed.
  void Keep(const ConstraintSet& guards) {
    for (std::size_t g = 0; g < ways_.size(); ++g) {
      if (!guards.Contains(static_cast<int>(g))) ways_[g] = Way::kNone;
    }
  }

  double lowest() const { return lowest_; }

 private:
  enum class Way : unsigned char { kNone, kRises, kFalls };

  std::vector<Way> ways_;  // of a guard that is followed [guards]
  Vector extreme_;         // the lowest since a guard falls, or the highest since it rises [guards]
  double largest_ = 0;     // that a guard of any step began with
  double lowest_ = std::numeric_limits<double>::infinity();
};

}  // namespace contact_flow
