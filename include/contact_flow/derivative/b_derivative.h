// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/piecewise_linear_map.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

struct BDerivativeOptions {
  /// Error allowed in the tangents, relative to the largest entry of each arc's propagator.
  double tolerance = 1e-9;
  /// Two selections that differ by less than this (relative) are one: the outcome is C¹ there.
  double kink_tolerance = 1e-9;
  /// All pieces of a cluster are refused beyond this many simultaneous activations (m! pieces).
  int max_activations_for_pieces = 7;
  /// … and the expanded map of a whole trajectory beyond this many pieces.
  std::size_t max_pieces = 20000;
};

/// The B-derivative of the outcome x(T) with respect to time and initial state (Theorem 1):
///   D φ(T, x; δt, w) = δt · F(φ(T, x)) + B(w),   B = Φ_N ∘ B_N ∘ … ∘ B_1 ∘ Φ_0,
/// with Φ_k the propagator of arc k (Lemma 1) and B_k the first-order map of transition k.
class BDerivative {
 public:
  /// Not kOk: there is no derivative (discontinuous, grazing, …); the message says why. Only the
  /// event maps may then be asked, for the outcome of each order.
  Status status;
  ContactMode initial_mode;
  Vector time;                   ///< F(φ(T, x)) [2d]
  std::vector<Matrix> arcs;      ///< Φ_0 … Φ_N [2d×2d]
  std::vector<EventMap> events;  ///< B_1 … B_N

  /// B(w) on one direction, in polynomial time.
  Vector operator()(const VectorRef& w) const;
  /// The same with a change of the horizon.
  Vector operator()(double dt, const VectorRef& w) const;
  /// Contact modes the perturbed run passes through, to first order, for the direction w.
  std::vector<ContactMode> PerturbedModes(const VectorRef& w) const;
  /// True when all selections agree: B is linear, the outcome is C¹ here.
  bool IsDifferentiable() const;
  /// B as the whole piecewise-linear map. Throws std::length_error, naming the limit, beyond it.
  PiecewiseLinearMap Pieces() const;

  BDerivativeOptions options;
};

/// Differentiates a trajectory made with SimulateOptions::dense; `system` must outlive the result. A trajectory whose status is not kOk
/// has no derivative: its status is passed on.
BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const VectorRef& u, const BDerivativeOptions& options = {});

/// w projected on the tangent vectors that the initial state admits: those that keep the constraints of
/// its contact mode active, Da_J w_q = 0 and D(Da_J v) w_q + Da_J w_v = 0 (least squares).
Vector ProjectAdmissible(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                         const VectorRef& w);

}  // namespace contact_flow
