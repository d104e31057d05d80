// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/guards.h"
#include "contact_flow/flow/trajectory.h"
#include "frictional_walk.h"

namespace contact_flow {

/// The first-order map of a transition of a system with friction (FrictionalWalk), in w at (ρ, v⁻):
/// whether it exists, one direction of it, and its pieces.
class FrictionalEvent {
 public:
  /// `inputs`: those after each change of the input in the cluster.
  FrictionalEvent(std::shared_ptr<ContactDynamics> dynamics, const Transition& transition,
                  std::vector<Vector> inputs);

  /// kDiscontinuous where simultaneous touchdowns that feel each other lead elsewhere in another
  /// order, here or around (FindLandingOrders).
  const Status& status() const { return status_; }
  const std::vector<OrderOutcome>& outcomes() const { return outcomes_; }
  /// Throws std::domain_error where the run perturbed along w, its changes of the input late by
  /// `dt`, is not decided.
  FrictionalPath Follow(const VectorRef& w, const VectorRef& dt) const;
  /// … with them in time.
  FrictionalPath Follow(const VectorRef& w) const { return Follow(w, InTime()); }
  /// All paths, whose cones cover all directions (PathSearch).
  std::vector<FrictionalPath> Paths(std::size_t max_pieces) const;
  /// What happens to the run perturbed along w, to first order.
  std::vector<PerturbedEvent> Events(const VectorRef& w) const;
  PiecewiseLinearMap Map() const;
  /// Of the pieces of Map().
  std::vector<PieceTimes> Times() const;
  /// Largest entry by which two pieces differ, in sizes; NaN where they are not known.
  double Kink() const;
  int size() const { return size_; }

 private:
  Vector InTime() const { return Vector::Zero(static_cast<Eigen::Index>(inputs_.size())); }
  void Classify();
  Vector AnyDirection() const;
  Vector Held(const Vector& w) const;
  void HoldCone(FrictionalPath* path) const;
  void FindModeAfter(OrderOutcome* outcome) const;
  std::vector<Vector> Around() const;
  bool LandAsOne() const;
  bool Decoupled(ConstraintSet contacts) const;

  std::shared_ptr<ContactDynamics> dynamics_;
  const MechanicalSystem* system_;
  Guards guards_;
  Transition transition_;
  std::vector<Vector> inputs_;
  int size_ = 0;
  Vector sizes_;  // of the entries of w, whatever the units [2d+k]
  // Orthonormal, in sizes: directions that open or close what the mode before holds, and those that
  // hold it [2d+k × ·].
  Matrix held_, holding_;
  Status status_;
  std::vector<OrderOutcome> outcomes_;
};

}  // namespace contact_flow
