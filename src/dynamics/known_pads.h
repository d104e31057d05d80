// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A FrictionProblem without pads of joints whose words follow from the others'. Of a pad that
/// slips the push is known. A pad whose joint rests on a stop slips as soon as the stop opens, and
/// only then, to that side: with the push c that it has then, what the stop has to press beside it,
/// λ ≥ 0, is the stop's force of a problem with independent rows,
///   y = G (λ + ρ λ_t) + b,  |λ_t| ≤ c     ⇔     y = G (λ' − |ρ| c) + b,  λ' = λ + ρ λ_t + |ρ| c,
/// where the pad's row is ρ times the stop's. How both share what holds the joint does not matter.
class KnownPads {
 public:
  explicit KnownPads(const FrictionProblem& whole);

  bool Any() const { return !pads_.empty(); }
  /// What is left; the whole where nothing is known.
  const FrictionProblem& Rest() const { return Any() ? rest_ : whole_; }
  /// Letters of the rest.
  std::vector<Letter> LettersOf(const std::vector<Letter>& whole) const;
  /// The solution of the whole that belongs to one of the rest.
  FrictionSolution Whole(const FrictionSolution& rest) const;

 private:
  struct Pad {
    std::size_t contact;
    double pressed;  // its normal force
    double sign;     // of its slip, or that which begins where the stop opens
    int stop;        // the contact of that, or −1
    double ratio;    // ρ
  };
  /// The stop on which the joint of pad i rests, or −1.
  int StopOf(std::size_t i) const;

  const FrictionProblem& whole_;
  std::vector<Pad> pads_;
  std::vector<std::size_t> kept_;  // contacts
  std::vector<int> rows_;          // theirs
  FrictionProblem rest_;
};

/// Those of `shared`, contacts of the mode whose rows are dependent at x, that share forces
/// otherwise than a stop does with the pad of its joint.
ConstraintSet SharedBesidePads(const MechanicalSystem& system, const Vector& x,
                               const ContactMode& mode, const ConstraintSet& shared);

}  // namespace contact_flow
