// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>

#include "contact_flow/analysis/poincare.h"
#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {

/// Why the section's g is no symmetry of the motion, or empty where nothing says so:
///   - a run that starts further along what travels, by t, ends further along by t: B t = t;
///   - where g(y) = x, y the end of the return and x its start, the motion from y is that from x:
///     g(φ(T, y)) = y, and E B_y E w = B w for w along the section.
/// B is the derivative of `result.trajectory` at fixed time, along its arcs 0 to `last`.
std::string SymmetryObstacle(const MechanicalSystem& system, const VectorRef& u,
                             const Section& section, const PoincareOptions& options,
                             const VectorRef& x, const PoincareReturn& result, const BDerivative& B,
                             std::size_t last);

}  // namespace contact_flow
