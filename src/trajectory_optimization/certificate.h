// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

namespace contact_flow {

/// Fills certificate and hull_distance of a minimum at y, computed anew from its models.
void Certify(const Unknowns& unknowns, const PieceModels& models, const Vector& y,
             TrajectoryOptimum* result);

}  // namespace contact_flow
