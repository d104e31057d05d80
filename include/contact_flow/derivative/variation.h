// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// How much work a propagator took.
struct VariationStatistics {
  long jacobians = 0;  ///< evaluations of DF_J
  long steps = 0;      ///< accepted
  long rejected_steps = 0;
  double flow_law_residual = 0;
  double error_estimate = 0;
  /// How far the state would have to move for the force of rigid member i to vanish, each
  /// coordinate by the same: the largest of λ_i / Σ_k |∂λ_i/∂x_k| seen along the arc
  /// [n]; 0 elsewhere.
  Vector push_reach;
};

/// The propagator of one arc (Lemma 1 of the paper): Φ(t_end) [2d+k × 2d+k] of the
/// variational equation
///   Φ̇ = D F_J(x(t)) Φ,   Φ(t_begin) = I,
/// in the tangents (δq, δv) and the k variables (δu, δp) of `dynamics`, whose rows are [0 0 I],
/// along the arc's dense output, which must be there; `dynamics` is scratch and holds
/// system and input.
///
/// Where the configuration space has rotations, δq̇ = δv − ad_v δq; in the coordinates (δq, δq̇) the
/// equation is of second order again, with K + D ad_v − ad_v̇ for K and D − ad_v for D.
///
/// The equation is linear, so it is solved by Gauss–Legendre collocation (2 to 10 stages, order 4
/// to 20, chosen with the step for least work), or by Radau IIA (order 3 to 19) where decays are
/// fast beside the step, with steps of its own: the accelerations at the
/// nodes solve one linear system a step, over those coordinates only that others do not determine
/// (a contact, a conserved momentum). The tangents have their own error control, `tolerance`
/// relative to the largest entry of the propagator, in units in which entries compare whatever
/// those of the system are (y_i √M_ii, and a time of the arc): in free flight the state is a
/// polynomial and its steps grow without bound, while the tangents (springs) still oscillate.
Matrix PropagateArc(ContactDynamics* dynamics, const Arc& arc, double tolerance,
                    VariationStatistics* statistics = nullptr);

}  // namespace contact_flow
