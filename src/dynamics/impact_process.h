// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// The first account of SolveTangentialImpact; contacts that would have to pull are let go, and
/// what sticks and leaves its cone slips from the beginning. Nothing where N v does not fall, or
/// does not return, a slip that has ended would leave its cone, or what was let go approaches.
std::optional<FrictionalImpact> FollowImpact(const MechanicalSystem& system, const VectorRef& q,
                                             const VectorRef& v_minus, const ContactMode& J,
                                             int jammed);

}  // namespace contact_flow
