// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/run_cost.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// A direction of a run that meets K intervals of its grid of inputs. What is empty is zero.
struct RunDirection {
  Vector initial;     ///< (δq, δv) of the initial state [2d]
  Matrix inputs;      ///< δu of each interval, a column each [m×K]
  Vector parameters;  ///< δp, of BDerivativeOptions::variables [k_p]

  /// What it is at the start: (δq, δv, δu, δp) with the input of the first interval [2d+k].
  Vector AtStart(const MechanicalSystem& system, const Variables& variables) const;
};

/// The gradient of the cost J of a run (RunCost) by all that a run may be given, at the price of
/// one covector that is carried backward along it:
///   λ(T) = ∂g/∂x,   λ̇ = −DFᵀ λ − ∂l/∂x,   λ⁻ = Ξᵀ λ⁺ + Σ_i (l_{i−1} − l_i) ∂τ_i   at events,
/// with Ξ and ∂τ_i the piece of the event map and of its instants. It is the transpose of the
/// forward derivative, step by step. Where orders of events have different maps, the gradient is
/// that of the piece that a direction w lies in: D J(w) = its inner product with w, and with all
/// others of that piece.
struct CostGradient {
  /// Not kOk: there is none; the message says why. As DifferentiateOutcome refuses, and
  /// kNotPiecewiseLinear where the outcome has directional derivatives but no gradient: at a kink
  /// without a direction, and where no linear piece holds the direction.
  Status status;
  double cost = 0;     ///< J
  Vector initial;      ///< by (δq, δv) of the initial state [2d]: λ(0)
  Matrix inputs;       ///< by the input of each interval of the grid, where asked for [m×K]
  Vector parameters;   ///< by the parameters asked for [k_p]
  Vector instants;     ///< by the instants when the input changes [K−1]
  double horizon = 0;  ///< by T; NaN where the input changes there: there are two
  /// False: it is the gradient of the direction's piece alone, or of the directions that a start
  /// which touches contacts admits.
  bool whole = true;
  std::vector<ContactMode> modes;  ///< that the run of this piece passes through, to first order

  /// Largest residual of λᵀF + l, which no arc without explicit time and no event of a contact
  /// changes, relative to the size of its terms. Above kLawLimit the gradient is withheld.
  double law = 0;
  double flow_law = 0;        ///< Φ F = F, as in Trust
  double event_law = 0;       ///< Ξ F⁻ = F⁺, as in Trust
  double neglected_jump = 0;  ///< an error bar of J: jumps that clusters neglect (ClusterReport)
  double cost_error = 0;      ///< estimated error of g(x(T)) by that of x(T)
  VariationStatistics statistics;  ///< what it took

  /// D J(w): the inner product. Throws std::invalid_argument for sizes.
  double Along(const RunDirection& w) const;
  /// By initial state and parameters as a start in contact admits them: of each entry what its
  /// projected direction does (StartDirections::Project). Along directions that keep the contact
  /// mode of the start nothing changes.
  void KeepStart(const MechanicalSystem& system, const Variables& variables,
                 const StartDirections& starts);
};

/// Differentiates the cost of a trajectory made with SimulateOptions::dense. The tolerance, the
/// limit of kinks and the variables of `options` hold; `direction` chooses the piece at kinks, and
/// may be null. A cost without parts throws std::invalid_argument, as do sizes of the direction,
/// and directions that leave the domain at the start.
CostGradient DifferentiateCost(const MechanicalSystem& system, const Trajectory& trajectory,
                               const RunCost& cost, const BDerivativeOptions& options = {},
                               const RunDirection* direction = nullptr);
/// The same for changes of the inputs in these cones: of others it tells nothing.
CostGradient DifferentiateCost(const MechanicalSystem& system, const Trajectory& trajectory,
                               const RunCost& cost, const BDerivativeOptions& options,
                               const RunDirection* direction, const InputCones& cones);

}  // namespace contact_flow
