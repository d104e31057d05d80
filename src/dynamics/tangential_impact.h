// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// The impact without collision that ends the slip of contact `jammed`, at normal rates of zero:
/// the shortest answer of rigid bodies where the force of a slip grows without bound (dynamic
/// jam, Painlevé). Followed along its normal impulse p, as Darboux and Keller do,
///   dv/dp = P (Nᵀ − μ Tᵀ d),   d = T v / |T v|,   until N v = 0 again,
/// P being M⁻¹ inside what the other members of J hold: N v of all, T v of what sticks; what slips,
/// or begins to, adds its own −μ Tᵀ d. A slip that comes to its end sticks. To 1e-8 of the
/// velocities. Where that does not end, or another contact would have to pull, by impulses alone:
///   M (v⁺ − v⁻) = A_Kᵀ p + Bᵀ r,   N v⁺ = 0,   T v⁺ = 0 for `jammed` and for what sticks in J,
///   p_n ≥ 0,   |p_t| ≤ μ p_n,   p_t = −μ p_n d of what slips on,
/// with the rows of the members of J that it finds pressed, or the p ≠ 0 of the impact law (F6),
/// N v⁻ = 0, in which `jammed` presses. The bounds of cones hold to 1e-3: the instant at which
/// forces are no longer finite is not known better. Nothing where no such p exists, or it would add
/// energy. An independent account: the limit of contacts that give way, ever stiffer
/// (test/friction/jam_test.cc).
std::optional<FrictionalImpact> SolveTangentialImpact(const MechanicalSystem& system,
                                                      const VectorRef& q, const VectorRef& v_minus,
                                                      const ContactMode& J, int jammed);

}  // namespace contact_flow
