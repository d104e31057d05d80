// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// Whether the normal row of contact i, which has friction, is felt by no other row, as that of the
/// pad that brakes a joint: its force is known.
bool StandsAlone(const FrictionProblem& problem, std::size_t i);

/// Units in which rows of a FrictionProblem can be compared, whatever those of the robot are:
///   λ = force ∘ λ',      y' = rate ∘ y.
/// Contacts keep theirs, 1/kg of G. Where one stands alone its tangential row may be that of a
/// joint: G' of this row is the mean of the others' [1/kg], and its μ' is about 1.
class RowUnits {
 public:
  explicit RowUnits(const FrictionProblem& problem);

  /// Whether any are not 1.
  bool Any() const { return any_; }
  const Vector& force() const { return force_; }
  const Vector& rate() const { return rate_; }

  /// The largest entry of rates b in these units.
  double Largest(const Vector& b) const;

  FrictionProblem Scaled(const FrictionProblem& problem) const;
  /// A solution of the scaled problem as one of the problem.
  void Return(FrictionSolution* solution) const;

 private:
  bool any_ = false;
  Vector force_, rate_;
};

/// What accelerations of normal rows are known to, by contact, in units of b: relative to that of
/// the whole, whose `energy` is aᵀ M a without forces. Of normal forces that stand alone what they
/// can hold counts.
Vector AccelerationRounding(const FrictionProblem& problem, const RowUnits& units, double energy);

}  // namespace contact_flow
