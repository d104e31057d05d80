// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "asked.h"
#include "run_request.h"
#include "setup.h"

namespace contact_flow {

/// Most directions one request may ask for.
inline constexpr std::size_t kMaxDirections = 512;

/// What became of directions that the initial state does not admit.
struct DirectionNote {
  enum class Kind { kLeftOut, kProjected };
  Kind kind = Kind::kLeftOut;
  std::string message;  ///< which, and why
};

/// Perturbations of the initial state, the inputs and the parameters, with their names.
struct Directions {
  /// "+left_foot_z", "-d/dt body_pitch", "+parameter stiffness", "direction_matrix[0]".
  std::vector<std::string> names;
  std::vector<Vector> vectors;       ///< w = (δq, δv, δu, δp) [2d+k] each
  std::vector<DirectionNote> notes;  ///< of what was left out or projected
};

/// What else to differentiate by; throws std::invalid_argument for an unknown parameter.
Variables ResolveVariables(const Setup& setup, bool by_inputs,
                           const std::vector<std::string>& by_parameters);
/// "input thrust", …, "parameter stiffness", …, in the order of the tangents.
std::vector<std::string> VariableNames(const SystemDescription& description,
                                       const Variables& variables);

/// The directions asked for by name and by matrix; with neither, both signs of every coordinate,
/// every velocity and every variable. Of these defaults the ones that the initial contact mode does
/// not admit are left out and noted; such a direction that was asked for throws
/// std::invalid_argument with its name. With asked.project either is replaced by its projection
/// instead, and noted.
Directions ResolveDirections(const Setup& setup, const ResolvedRun& run,
                             const AskedDirections& asked, const Variables& variables);

}  // namespace contact_flow
