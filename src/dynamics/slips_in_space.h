// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// The contacts that slip with friction in a plane of their own: their slips end without a sign
/// change, and where one begins or ends its direction turns fast without bound.
ConstraintSet SlipsInSpace(const MechanicalSystem& system, const ContactMode& mode);

}  // namespace contact_flow
