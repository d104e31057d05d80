// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/model/rigid_body/constraint_element.h"

namespace contact_flow {

/// The directions in which a contact slips, by the freedoms that move its bodies. Where all of them
/// turn about parallel axes, or slide across these, the contact stays in a plane: one direction,
/// along m × n for the plane's normal m and the contact's n, of the sense that m × z has a positive
/// x (or, without one, y); slip forward along x on level ground. Elsewhere two. Throws
/// std::invalid_argument where there are fewer freedoms than normal and tangential directions: the
/// contact could not slip.
SlipFrame FindSlipFrame(const RobotModel& model, const ElementParts& parts);

/// Gives a contact friction, of `coefficient` or infinite. Throws std::invalid_argument for
/// constraints at which no surfaces touch, and as above.
void GiveFriction(const RobotModel& model, double coefficient, ConstraintElement* element);

}  // namespace contact_flow
