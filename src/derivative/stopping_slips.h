// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What (F7) takes for granted. Contacts that stick at x in `mode`, and to which w [2d+k] gives
/// slips s = D(T v) w, slip for a time of first order, at accelerations that are constant between
/// their stops in the plane, and turn with s/|s| in space. Follows them from stop to stop and
/// throws std::domain_error, naming the contact, where one lets go meanwhile, does not come to
/// rest, reverses a slip that begins at x, where one of `brushed`, open contacts whose gaps are 0
/// along w, touches again, or where the word is not decided. `rate_jacobian` is D(A v) of all rows
/// [n+l+r × 2d+k]; `dynamics` is scratch.
void CheckStops(ContactDynamics* dynamics, const Vector& x, ContactMode mode, ConstraintSet brushed,
                const Matrix& rate_jacobian, const Vector& w);

}  // namespace contact_flow
