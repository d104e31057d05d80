// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/inverse_inertia.h"

namespace contact_flow {

/// The run perturbed along one direction while it passes a cluster, in the limit of small
/// perturbations: time, gaps of what is hit and rates of what rests are counted in α, gaps of
/// contacts that opened in α². Between two events velocities are v_S and
///   ẇ = F,   r_j = D(Da_j v) w,   ṙ_j = ä_j,   ġap_j = r_j.
class Germ {
 public:
  /// `w` [2d+k+c] as EventMap::Widen makes it.
  Germ(const EventMap& map, const VectorRef& w);
  /// Passes all events, and lists them where `events` is given; B(w) at the end.
  Vector Run(std::vector<PerturbedEvent>* events);

 private:
  enum class Kind { kNone, kActivation, kRelease, kClosing, kRest };
  struct Next {
    Kind kind = Kind::kNone;
    int constraint = -1;
    double in = 0;  // time to it [s], of first order
  };
  Next FindNext() const;
  void OfferReleases(Next* next) const;
  void Advance(double time);
  void PassActivation(int i);
  void PassClosing(int j);
  void Rest(int j);
  void Enter(ConstraintSet candidates);
  void KeepPending();
  void CheckEnd() const;
  /// An impact of first-order speeds of the contacts in `touching`, 0 ≤ p ⟂ r⁺ + γ r⁻ ≥ 0, while
  /// those in `kept` keep their rates. Returns those that leave.
  ConstraintSet Strike(ConstraintSet touching, ConstraintSet kept, bool plastic);
  double Rate(int j) const;
  double GapAcceleration(int j) const;
  /// What rounding leaves of a rate or acceleration.
  double RateNoise(int j) const;
  double AccelerationNoise(int j) const;
  double ClosingTime(int j, double gap) const;
  /// Time to the end of all bounces of j, which has just bounced; +∞ where it leaves.
  double RestTime(int j) const;
  const InverseInertia& inertia() const;
  [[noreturn]] void Refuse(int j, const char* why) const;

  const EventMap& map_;
  Vector w_;
  double elapsed_ = 0;
  ConstraintSet S_;               // activations so far
  const EventMap::Stage* stage_;  // v_S and the field in the present mode
  ConstraintSet closed_;          // rigid contacts with gap and rate zero that push
  std::map<int, double> gaps_;    // of contacts that opened, in α²
  ConstraintSet bouncing_;        // of these, those that have bounced
  ConstraintSet below_;           // plastic and hit in this stage, with a negative restitution
  bool lists_events_ = false;     // then also forces that pass zero are looked at:
  ConstraintSet pending_;         // members of J⁻ whose force has still to vanish
  ConstraintSet released_;        // those whose force vanished in this stage
  int strikes_ = 0;
};

}  // namespace contact_flow
