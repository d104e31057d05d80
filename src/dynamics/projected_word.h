// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// A solution near a fixed point of
///   λ_i = proj (λ_i − ρ_i (y_i + μ |y_t| e_n))  onto the cone of contact i,
/// one contact after the other (G. De Saxcé & Z.-Q. Feng, The bipotential method, 1998), from no
/// forces on: its letters and directions, polished (PolishSlips) once these are near enough. For
/// where the grid of FindSlipDirections has no start from which Newton's method gets there: nearly
/// jammed contacts answer a thousand times. Inequalities hold but for `missed`, relative. Nothing
/// where that does not converge within some thousand rounds.
[[nodiscard]] std::optional<FrictionSolution> FindProjectedWord(const FrictionProblem& problem,
                                                                double missed);

}  // namespace contact_flow
