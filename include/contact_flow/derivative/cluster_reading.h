// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The two readings of events that a run merged into a cluster although they are not quite
/// simultaneous. From x + α w they happen in the order of
///   t_i + α τ_i(w),
/// with t_i their instants in the run (Transition::instants). Beyond the inner radius this is the
/// order of the τ_i, which B(w) follows; close to α = 0 it is that of the t_i. Likewise a slip with
/// which the run starts, less than the tolerance (StartCone::InnerRadius).
struct ClusterReading {
  /// B(w) holds for α beyond it; 0 where both readings are the same. Where the instants of two
  /// events differ by less than their estimated errors, their order is not known, and those errors
  /// stand for Δt: also where the order that the run found is that of w.
  double inner_radius = 0;
  /// The derivative along the order of the instants, for α below it; NaN where that has no
  /// selection (EventMap::PiecewiseLinear), and with friction where it is another [2d].
  Vector in_order;
};

/// For a direction w = (δq, δv, δu, δp) [2d+k] of the derivative of a trajectory from its first arc
/// on. O(N m (2d+k)²).
ClusterReading ReadClusters(const BDerivative& derivative, const VectorRef& w);

}  // namespace contact_flow
