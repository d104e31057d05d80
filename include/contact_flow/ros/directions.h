// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/RowMajorMatrix.h"
#include "contact_flow/ros/request.h"

namespace contact_flow {
namespace ros_interface {

/// Most directions one request may ask for.
inline constexpr std::size_t kMaxDirections = 512;

/// Perturbations of the initial state, with their names.
struct Directions {
  std::vector<std::string> names;  ///< "+left_foot_z", "-d/dt body_pitch", "direction_matrix[0]"
  std::vector<Vector> vectors;     ///< w = (δq, δv) [2d] each
  std::string note;                ///< what was left out or projected, for the answer's message
};

/// The directions asked for by name and by matrix; with neither, both signs of every coordinate and
/// every velocity. Of these defaults the ones that the initial contact mode does not admit are left
/// out and noted; such a direction that was asked for throws std::invalid_argument with its name.
/// With `project` either is replaced by its projection instead, and noted.
Directions ResolveDirections(const Setup& setup, const Run& run,
                             const std::vector<std::string>& names, const RowMajorMatrix& matrix,
                             bool project);

}  // namespace ros_interface
}  // namespace contact_flow
