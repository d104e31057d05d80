// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// One way through a cluster of events with friction: what happens to every w in its cone.
struct FrictionalPath {
  Matrix matrix;                   ///< Ξ [2d+k × 2d+k]
  Matrix cone;                     ///< decisions: rows with cone·w ≥ 0 [· × 2d+k]
  std::vector<int> guards;         ///< in the order in which they vanish
  std::vector<ContactMode> modes;  ///< after each of them
  Matrix times;                    ///< first-order changes of their instants, a row each
  double margin = 0;               ///< smallest cone·w of the w that led here, relative
};

/// The first-order map of a transition of a system with friction, in w at (ρ, v⁻): by following the
/// perturbed run from guard to guard, in the order of their first-order instants.
///
///   w ← w + F τ,  τ = −Dh w / (Dh F)      of the guard h that vanishes first, in the present word,
///   w ← R'(w)                             (F6) at a touchdown, on the branch that w chooses,
///   next word by (F4), a contact whose slip is zero at the base point going the way of D(T v) w,
///   w ← w − F⁺ τ.
///
/// Slip onset, release from slip and the cone's apex are identities. Guards with a jump of the
/// field are touchdowns, stops and reversals, and releases without slip (μ = ∞). A contact that
/// sticks and has D(T v) w ≠ 0 begins to slip and is stopped at once, by the projection (F7).
class FrictionalEvent {
 public:
  FrictionalEvent(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition);

  /// kDiscontinuous where simultaneous touchdowns are neither of class A_f nor of class B_f.
  const Status& status() const { return status_; }
  const std::vector<OrderOutcome>& outcomes() const { return outcomes_; }
  /// Throws std::domain_error where the run perturbed along w is not decided.
  FrictionalPath Follow(const VectorRef& w) const;
  /// All paths, from cone to cone. Throws std::length_error beyond `max_pieces`.
  std::vector<FrictionalPath> Paths(std::size_t max_pieces) const;
  /// What happens to the run perturbed along w, to first order.
  std::vector<PerturbedEvent> Events(const VectorRef& w) const;
  PiecewiseLinearMap Map() const;
  /// Largest entry by which two pieces differ, NaN where they are not known.
  double Kink() const;
  int size() const { return size_; }

 private:
  class Walk;
  void Classify();
  bool Decoupled(ContactMode contacts) const;

  std::shared_ptr<ContactDynamics> dynamics_;
  const MechanicalSystem* system_;
  Guards guards_;
  Transition transition_;
  int size_ = 0;
  Status status_;
  std::vector<OrderOutcome> outcomes_;
};

}  // namespace contact_flow
