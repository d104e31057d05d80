// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/model/parameter_values.h"
#include "contact_flow/piecewise_linear/newton.h"

namespace contact_flow {

/// What an orbit must fulfil besides being periodic.
struct OrbitCondition {
  /// What is asked for.
  enum class Kind {
    kPeriod = 0,      ///< the time of return is `value` [s]
    kCoordinate = 1,  ///< position number `index` is `value` at the section
    kVelocity = 2,    ///< the same of a velocity
    kTouchdown = 3,   ///< constraint `index` touches down `value` seconds after the section
    kLiftOff = 4,     ///< it lifts off `value` seconds after the section
  };
  Kind kind = Kind::kPeriod;  ///< what is asked for
  int index = 0;              ///< of the coordinate or constraint
  double value = 0;           ///< that it has to have
  /// Of touchdown and lift-off: with another constraint, `value` is the time by which `index` is
  /// later; 0: they are simultaneous.
  int other = -1;
  int occurrence = 1;  ///< the first, second, … such event of the period, of both constraints
};

/// What is looked for: a state x with P(x) = x, and values of some parameters for which the
/// conditions hold.
struct OrbitProblem {
  SystemFactory factory;                        ///< makes the system of given parameters
  ParameterValues parameters;                   ///< of the start; those left out are the model's
  std::vector<std::string> unknown_parameters;  ///< names
  Section section;                              ///< where the orbit closes
  Vector x;                                     ///< start [nq+d]
  Vector u;                                     ///< [m]
  std::vector<OrbitCondition> conditions;       ///< beside closing
};

/// Settings of the search.
struct OrbitOptions {
  PoincareOptions poincare;  ///< its variables and wanted events are set as needed
  NewtonOptions newton;      ///< its `add` is set as needed

  /// Symmetries make families of orbits: along them the shortest step is taken, which is none.
  OrbitOptions() { newton.rank_tolerance = 1e-8; }
};

/// An orbit, or how far the search came.
struct OrbitSolution {
  NewtonResult newton;         ///< its x is (state, unknown parameters), its residual (P(x) − x,
                               ///< conditions) in the units of the system
  Vector x;                    ///< [nq+d]
  ParameterValues parameters;  ///< all of them
  std::unique_ptr<MechanicalSystem> system;  ///< with these
  PoincareReturn orbit;  ///< one period from x, with DP by (δq, δv) where it exists

  /// Whether an orbit was found.
  bool ok() const { return newton.ok(); }
};

/// Looks for a periodic orbit by B-Newton: the unknowns are the tangents (δq, δv) that the contact
/// mode of the start admits, slips of sticking contacts held, and δp, the equations
///   P(x, p) ⊟ x = 0 [2d],   condition_k(x, p) = 0,
/// each beside its size on the first motion (OrbitSizes): `newton.tolerance` is of those, and what
/// the iterates tell of the residual. A search also ends, as converged, where the residual is no
/// more than what the tolerances of the runs let be known of it, and a step gains nothing.
/// Where a budget ends just the run that is to be shown, the search counts as cancelled.
/// Works through simultaneous touchdowns, where P is piecewise differentiable: the residual tells
/// events apart that are 1e-13 of the period apart, and is continuous; the derivative takes those
/// within the simultaneity tolerance as one, and has the pieces of all their orders.
/// Which conditions are independent is not asked: more than unknowns, or fewer, are solved where
/// they are consistent.
/// Throws std::invalid_argument for unknown parameters and for conditions the system has not.
OrbitSolution FindOrbit(const OrbitProblem& problem, const OrbitOptions& options = {});

}  // namespace contact_flow
