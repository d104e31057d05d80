// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

#include "contact_flow/flow/guard_search.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// The margin of shared forces on a step, θ from 0 to 1, with forces that lead to the motion there
/// and its gradient by them, which sees no difference between those that do.
struct SharedMargin {
  double theta, value;
  Vector force, gradient;
};

/// Looks for the first zero of the margin, below −floor behind it. The margin is a concave function
/// of the forces, with kinks: on a piece it is no less than its values at the ends, but for what
/// forces differ from straight lines; no interpolant is asked for. Where the step takes more than a
/// few hundred samples `event` tells how much of it is clear.
void SearchSharedMargin(int guard, double floor,
                        const std::function<SharedMargin(double theta)>& sample,
                        LocatedEvent* event);

}  // namespace contact_flow
