// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// What may have brought a motion to an instant that no step passes, each as a text that follows a
/// message; "" where it has not.

/// Which velocities move no mass at x.
std::string SingularMass(const MechanicalSystem& system, const Vector& x, const Vector& u,
                         const ContactMode& mode);
/// Which bilateral constraint depends on those before it at x, or has vanished, or nearly so, by
/// the `size` that each has had [l]; where that is empty, by the longest.
std::string LostLoop(const MechanicalSystem& system, const Vector& x, const Vector& size);

}  // namespace contact_flow
