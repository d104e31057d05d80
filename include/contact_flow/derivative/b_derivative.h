// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "contact_flow/derivative/held_together.h"
#include "contact_flow/derivative/start_cone.h"
#include "contact_flow/derivative/start_stop.h"
#include "contact_flow/derivative/trust.h"
#include "contact_flow/derivative/turned_impulses.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"

namespace contact_flow {

/// Settings of DifferentiateOutcome.
struct BDerivativeOptions {
  /// Error allowed in the tangents, relative to the largest entry of each arc's propagator.
  double tolerance = 1e-9;
  /// Two selections that differ by less than this (relative) are one: the outcome is C¹ there.
  double kink_tolerance = 1e-9;
  /// All pieces of a cluster are refused beyond this many simultaneous activations (m! pieces).
  int max_activations_for_pieces = 7;
  /// … and the expanded map of a whole trajectory beyond this many pieces.
  std::size_t max_pieces = 20000;
  /// What else to differentiate by, constant along the run: inputs (with a schedule, a shift of all
  /// of it) and parameters. The initial state stays as it is.
  Variables variables;
};

/// The B-derivative of the outcome x(T) with respect to time, initial state, inputs and parameters
/// (Theorem 1):
///   D φ(T, x, u, p; δt, w) = δt · F(φ(T, x)) + B(w),   B = Φ_N ∘ B_N ∘ … ∘ B_1 ∘ Φ_0,   w = (δq,
///   δv, δu, δp),
/// with Φ_k the propagator of arc k (Lemma 1) and B_k the first-order map of transition k, both of
/// which carry (δu, δp) along.
class BDerivative {
 public:
  /// Not kOk: there is no derivative (discontinuous, grazing, …); the message says why. Only the
  /// event maps may then be asked, for the outcome of each order.
  Status status;
  ContactMode initial_mode;  ///< that of the start
  StartCone start;           ///< directions into contacts that the start touches
  StartStop start_stop;      ///< what sticks at the start and is made to slip is stopped
  Vector time;               ///< F(φ(T, x)) [2d]
  /// The input changes at T: `time` is that of shorter runs, longer ones have another.
  bool input_changes_at_end = false;
  std::vector<Matrix> arcs;        ///< Φ_0 … Φ_N [2d+k × 2d+k]
  std::vector<HeldTogether> held;  ///< what each of these asks of the directions
  /// B_1 … B_N. Where changes of the input coincide with events of contacts, the first of these
  /// transitions has the map of all, and the others have the identity (EventMap::absorbed).
  std::vector<EventMap> events;
  /// An error bar: jumps between the orders of impacts that were neglected at the clusters
  /// (ClusterReport), carried to T [2d], [m] and [m/s]. 0 where none was.
  Vector neglected_jump;
  /// The same for the entries of the derivative: couplings that were taken for orthogonal.
  double neglected_derivative = 0;
  Trust trust;  ///< the laws that it was held to, the errors that are left
  /// What Error is made of: estimated relative errors of Φ_0, B_1, Φ_1, …, Φ_N as
  /// they are computed;
  std::vector<double> part_errors;
  /// what the error of the state changes in Φ_k w, E_k w, by the change of the Jacobian
  /// [2d × 2d+k].
  std::vector<Matrix> part_bends;
  /// what turned slips change in B_k.
  std::vector<TurnedImpulses> part_turns;

  /// B(w) [2d] on one direction w [2d+k], or [2d] with (δu, δp) = 0, in polynomial time. Throws
  /// std::invalid_argument for a direction that leaves the domain at the start, naming the
  /// constraint, and std::domain_error like EventMap, or where the status is not kOk.
  Vector operator()(const VectorRef& w) const;
  /// The same with a change of the horizon; std::domain_error for a longer one where the input
  /// changes at T.
  Vector operator()(double dt, const VectorRef& w) const;
  /// w behind what happens at the start, [2d+k]: impacts with a speed of first order, slips that
  /// stop. Throws as above.
  Vector Begin(const VectorRef& w) const;
  /// Φ_k w of one arc. Throws std::domain_error where w moves apart what it holds (HeldTogether).
  Vector Along(std::size_t k, const Vector& w) const;
  /// Estimated error of B(w) [2d], absolute.
  Vector Error(const VectorRef& w) const;
  /// Contact modes the perturbed run passes through, to first order, for the direction w.
  std::vector<ContactMode> PerturbedModes(const VectorRef& w) const;
  /// kOk where no direction moves apart what an arc holds on dependent rows.
  Status Together() const;
  /// kOk where B is piecewise linear on the directions that the start admits, or why it is not.
  Status PiecewiseLinear() const;
  /// True when all selections agree and every direction is admitted: the outcome is C¹ here.
  bool IsDifferentiable() const;
  /// B as the whole piecewise-linear map ℝ^{2d+k} → ℝ^{2d}, its cones restricted to the directions
  /// that the start admits. Throws std::length_error, naming the limit, beyond it, and
  /// NotPiecewiseLinear.
  PiecewiseLinearMap Pieces() const;
  /// Those of what happens at the start and of the first arc, Φ_0 w behind the start
  /// [2d+k × 2d+k]. Throws NotPiecewiseLinear.
  PiecewiseLinearMap FirstPieces() const;

  BDerivativeOptions options;  ///< those that it was computed with

  /// Fills what was neglected.
  void CarryNeglected();

 private:
  Vector Complete(const VectorRef& w) const;
  /// w behind the start, at the end of the first arc.
  Vector First(const VectorRef& w) const;
};

/// The changes of the inputs that matter on each interval of the input, at least those that the run
/// meets: the cone of these columns [m × ·]. Empty: all. An effort that an input puts right on its
/// limit has a derivative where no other change leads beyond: that of the side within.
using InputCones = std::vector<Matrix>;

/// Not kOk where a transition has no first-order map because of what it is: bounces that were
/// completed to sticking, and what Transition::obstacle says.
Status CheckTransition(const Transition& transition);

/// Differentiates a trajectory made with SimulateOptions::dense, whose arcs know their inputs;
/// `system` must outlive the result. A trajectory whose status is not kOk has no derivative: its
/// status is passed on.
BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const BDerivativeOptions& options = {});
/// The same for changes of the inputs in these cones; for others B(w) is not to be asked.
BDerivative DifferentiateOutcome(const MechanicalSystem& system, const Trajectory& trajectory,
                                 const BDerivativeOptions& options, const InputCones& cones);
/// The first from the beginning of arc `first` to the end of arc `last`.
BDerivative DifferentiateArcs(const MechanicalSystem& system, const Trajectory& trajectory,
                              std::size_t first, std::size_t last,
                              const BDerivativeOptions& options = {}, const InputCones& cones = {});

/// w [2d+k] projected on the tangent vectors that the initial state admits: those that keep the
/// constraints of its contact mode and the bilateral ones active, Da_J w_q + ∂a_J/∂p δp = 0 and
/// D(Da_J v) w + Da_J w_v = 0, by the shortest change of (w_q, w_v) without driven velocities, the
/// rates of clocks. Contacts without slip keep T v = 0, too; others that stick may begin to slip.
Vector ProjectAdmissible(const MechanicalSystem& system, const VectorRef& x, ContactMode mode,
                         const VectorRef& w, const Variables& variables = {});

}  // namespace contact_flow
