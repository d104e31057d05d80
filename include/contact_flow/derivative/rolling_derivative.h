// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/online_flow.h"

namespace contact_flow {

/// The B-derivative from a marked instant to now, along chosen directions, while an OnlineFlow goes on:
///   B(w_j) = Φ_N ∘ B_N ∘ … ∘ B_1 ∘ Φ_0 w_j,   now · w_j = columns [2d+k × m],
/// each factor applied as the motion passes it. What DifferentiateOutcome gives for the whole of the motion, up to the
/// tolerance; the cost of a call does not grow with the time since the mark.
///
///   RollingDerivative rolling(flow, directions, options);      // the mark: flow->now()
///   const bool passed = flow.AdvanceTo(t);  rolling.Follow(&flow, passed);   // after every AdvanceTo
class RollingDerivative {
 public:
  /// Marks flow->now(), where the perturbations w_j [2d+k × m] are; the flow keeps its motion from now on. The system
  /// must outlive this. Throws std::invalid_argument for directions of the wrong size or not finite.
  RollingDerivative(OnlineFlow* flow, const Matrix& directions, const BDerivativeOptions& options,
                    double simultaneity_tolerance);

  /// Goes on to flow->now(); `passed` is what AdvanceTo returned.
  void Follow(OnlineFlow* flow, bool passed);

  double mark() const { return mark_; }  ///< [s]
  double now() const { return now_; }    ///< [s]
  const Matrix& directions() const { return directions_; }
  /// (δq, δv) at now() of each direction [2d × m]; frozen where the status is not kOk.
  Matrix tangents() const { return tangents_.topRows(2 * system_.dof()); }
  /// F at now() [2d]: what a change of the horizon adds.
  Vector TimeColumn(OnlineFlow* flow);
  /// Not kOk: an event on the way has no first-order map, and the message says why.
  const Status& status() const { return status_; }

 private:
  void Propagate(Arc motion);
  void Pass(const Transition& transition);
  ContactDynamics* DynamicsAt(const Vector& u);

  const MechanicalSystem& system_;
  const BDerivativeOptions options_;
  const double simultaneity_tolerance_;
  const Matrix directions_;
  const double mark_;
  double now_;
  Matrix tangents_;  // [2d+k × m]
  Status status_;
  std::optional<Transition> last_;
  std::shared_ptr<ContactDynamics> dynamics_;
};

}  // namespace contact_flow
