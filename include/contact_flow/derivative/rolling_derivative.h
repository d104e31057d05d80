// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/online_flow.h"

namespace contact_flow {

/// The B-derivative from a marked instant to now, along chosen directions, while an
/// OnlineFlow goes on:
///   B(w_j) = Φ_N ∘ B_N ∘ … ∘ B_1 ∘ Φ_0 w_j,   now · w_j = columns [2d+k × m],
/// each factor applied as the motion passes it. What DifferentiateOutcome gives for the whole of
/// the motion, up to the tolerance, and refused for the same reasons; the cost of a call does not
/// grow with the time since the mark.
///
/// Arcs are propagated slice by slice, each of which ends at a multiple of 1/kSliceRate or with its
/// arc. What has passed since the last one ended is propagated for a reading, and then forgotten.
/// So readings at an instant are the same, to the bit, whatever the instants at which the run was
/// looked at before.
///
///   RollingDerivative rolling(flow, directions, options);      // the mark: flow->now()
///   const bool passed = flow.AdvanceTo(t);  rolling.Follow(&flow, passed);   // after every
///   AdvanceTo rolling.Read(&flow).tangents;                                            // at will
class RollingDerivative {
 public:
  /// [1/s]: readings at rates that divide it cost nothing of their own.
  static constexpr double kSliceRate = 1000;

  /// Marks flow->now(), where the perturbations w_j [2d+k × m] are; the flow keeps its motion from
  /// now on. `run` are the options that the flow was made with. The system must outlive this. Where
  /// the state touches contacts outside its mode it is a cluster of its own (StartCone): the status
  /// is not kOk where a direction leads through one of them, or has no first-order map. Throws
  /// std::invalid_argument for directions of the wrong size or not finite.
  RollingDerivative(OnlineFlow* flow, const Matrix& directions, const BDerivativeOptions& options,
                    const SimulateOptions& run);

  /// Goes on to flow->now(); `passed` is what AdvanceTo returned.
  void Follow(OnlineFlow* flow, bool passed);

  double mark() const { return mark_; }  ///< [s]
  /// Those that are carried along [2d×k].
  const Matrix& directions() const { return directions_; }
  /// Not kOk: the mark or an event on the way has no first-order map, and the message says why.
  const Status& status() const { return status_; }

  /// The derivative at t. Where the status is not kOk it is frozen at an earlier t.
  struct Reading {
    double t = 0;     ///< [s]
    Matrix tangents;  ///< (δq, δv) of each direction [2d × m]
    Vector time;      ///< F at flow->now() [2d]: what a change of the horizon adds
    Status status;    ///< whether there is a derivative
  };
  /// At flow->now(), which Follow has been told of.
  Reading Read(OnlineFlow* flow);

 private:
  /// Where the slice that begins at node_ ends, unless the arc does before.
  double SliceEnd() const;
  /// The arc of the motion from node_ to `end`.
  Arc Slice(const Arc& motion, double end) const;
  /// Not kOk where a slice may not be differentiated; `forces_decide` as in ArcInRun.
  Status CheckSlice(const Arc& slice, bool forces_decide);
  /// The tangents at the end of a slice; the reach of forces along the arc grows by it.
  Matrix Propagated(const Arc& slice, Vector* push_reach);
  /// Not kOk where a contact of the present arc, in which forces have this reach up to `end`, holds
  /// without one, or slides in a face.
  Status CheckHolds(const Arc& motion, const Vector& push_reach, double end) const;
  void Start(OnlineFlow* flow, const SimulateOptions& run);
  /// The end of the arc of the motion, and the transition there.
  void PassArc(const OnlineFlow& flow, const Arc& motion);
  void Pass(const OnlineFlow& flow);
  /// Whether it is of the cluster of the last ones.
  bool IsClose(const Transition& transition) const;
  void Pass(const EventMap& event, ContactDynamics* before, ContactDynamics* after);
  ContactDynamics* DynamicsAt(const Vector& u);

  const MechanicalSystem& system_;
  const BDerivativeOptions options_;
  const SimulateOptions run_;
  const Matrix directions_;
  const double mark_;
  double node_;        // where the last slice has ended
  Matrix tangents_;    // there [2d+k × m]
  double arc_begin_;   // of the present arc, or the mark
  Vector push_reach_;  // of forces from arc_begin_ to node_ [n]
  Status face_;        // whether it begins with a face that slides
  Status status_;
  /// The last transitions, each close to the one before, and the tangents before them: where the
  /// input changes among them they are one cluster, which takes the place of their own maps.
  std::vector<Transition> cluster_;
  Matrix before_cluster_;
  std::shared_ptr<ContactDynamics> cluster_dynamics_;             // before
  std::vector<std::shared_ptr<ContactDynamics>> cluster_inputs_;  // after each change of the input
  std::shared_ptr<ContactDynamics> dynamics_;
};

}  // namespace contact_flow
