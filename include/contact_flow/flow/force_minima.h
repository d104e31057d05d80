// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <limits>

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

  explicit ForceMinima(int guards) : extreme_(guards) {}

  /// A step of these places, in which guard g has these values at the nodes. Changes below `noise`
  /// or below kForceNoise of it are none.
  void Pass(int g, const StagePlaces& places, const Values& values, double noise);
  /// Behind a transition: guards that are not in this set are no longer followed.
  void Keep(const ConstraintSet& guards) { followed_ = followed_ & guards; }

  double lowest() const { return lowest_; }

 private:
  ConstraintSet followed_, falling_;
  Vector extreme_;  // the lowest since a guard falls, or the highest since it rises [guards]
  double lowest_ = std::numeric_limits<double>::infinity();
};

}  // namespace contact_flow
