// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The outcome of one interval of an input grid, to first order: δx_{k+1} = A_k δx_k + B_k δu_k,
/// saltations and resets inside; what iLQR and Kalman filters consume. Events that coincide with
/// the instant at which it ends are inside, and x_end is behind them.
struct IntervalLinearization {
  double t_begin = 0;  ///< [s]
  double t_end = 0;    ///< [s]
  Vector x_begin;      ///< [nq+d]
  Vector x_end;        ///< [nq+d]
  Status status;       ///< not kOk: no derivative, and A, B are empty
  Matrix A;            ///< [2d×2d]
  Matrix B;            ///< [2d×m]
  /// False where an event inside is only piecewise differentiable: then [A B] is the selection of
  /// one order of its activations, and `derivative` holds them all.
  bool is_linear = true;
  BDerivative derivative;  ///< of the interval
};

/// Linearizes a trajectory by the intervals of its input grid, for changes of the inputs in the
/// cones; `system` must outlive the result.
std::vector<IntervalLinearization> Linearize(const MechanicalSystem& system,
                                             const Trajectory& trajectory,
                                             BDerivativeOptions options = {},
                                             const InputCones& cones = {});

}  // namespace contact_flow
