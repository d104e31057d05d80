// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/piecewise_linear/descent.h"

namespace contact_flow {

/// A number that may be chosen: one of the initial state or of the input.
struct OutcomeUnknown {
  /// What may be changed.
  enum class Kind { kPosition = 0, kVelocity = 1, kInput = 2 };
  Kind kind = Kind::kInput;  ///< what may be changed
  int index = 0;             ///< of position, velocity or input
};

/// What an outcome costs, and what may be chosen to lower it:
///   J = ½ Σ w_i (x_i(T) − target_i)² + ½ Σ r_j u_j²,      x = (q, v) [nq+d].
struct OutcomeProblem {
  Vector x;                              ///< initial state [nq+d]
  Vector u;                              ///< input [m]
  double duration = 0;                   ///< T [s]
  std::vector<OutcomeUnknown> unknowns;  ///< what may be changed
  Vector target;                         ///< [nq+d]
  Vector weight;                         ///< w ≥ 0 [nq+d]
  Vector effort;                         ///< r ≥ 0 [m]
  SimulateOptions simulate;              ///< options of runs
  BDerivativeOptions derivative;         ///< options of derivatives
  /// Events closer than this count as one when a nearby kink is looked for [s].
  double kink_interval = 1e-6;

  OutcomeProblem() {
    simulate.relative_tolerance = simulate.absolute_tolerance = 1e-12;
    simulate.simultaneity_tolerance = 1e-9;
    derivative.tolerance = 1e-11;
  }
};

/// J as a function of the unknowns' values y, for Minimize. `system` must outlive it. Throws
/// std::invalid_argument for sizes, for indices, and for positions that are no coordinate of their
/// own (quaternions).
NonsmoothCost MakeOutcomeCost(const MechanicalSystem& system, const OutcomeProblem& problem);

/// The unknowns' values in the problem: a start.
Vector UnknownValues(const MechanicalSystem& system, const OutcomeProblem& problem);
/// The problem with the unknowns at y.
OutcomeProblem WithUnknowns(const MechanicalSystem& system, OutcomeProblem problem,
                            const VectorRef& y);

}  // namespace contact_flow
