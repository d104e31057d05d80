// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "contact_flow/flow/transition.h"

namespace contact_flow {

/// Takes slow speeds of all that touches at (t, x) to rest together, however little that follows
/// from the laws, which have no motion here or none that is resolved: what slips faster slips on.
/// The transition tells it with `why`. Nothing where no letters fit behind that either.
std::optional<ResolvedTransition> ResolveBySettling(ContactDynamics* dynamics, double t,
                                                    const Vector& x, ContactMode mode,
                                                    const TransitionRules& rules, Outcome outcome,
                                                    const std::string& why);

}  // namespace contact_flow
