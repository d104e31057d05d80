// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "contact_flow/constraint_set.h"
#include "touching_frame.h"

namespace contact_flow {

/// Contacts that G couples, group by group; `orthogonal`(i, j) says where G_ij counts as 0.
std::vector<ConstraintSet> Groups(ConstraintSet touching,
                                  const std::function<bool(int, int)>& orthogonal);

/// One contact, or class B: γ = 0 and G_ij ≤ 0 for all pairs of the group.
bool Harmless(const TouchingFrame& frame, ConstraintSet group,
              const std::function<bool(int, int)>& orthogonal);

}  // namespace contact_flow
