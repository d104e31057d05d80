// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/PeriodicOrbitRequest.h"
#include "contact_flow/PeriodicOrbitResult.h"
#include "src/session/setup.h"
#include "watch.h"

namespace contact_flow {
namespace ros_interface {

/// The result of `find_periodic_orbit`, a function of setup and request alone unless it is
/// cancelled. Throws std::invalid_argument, naming the field, for a request that is not in order.
PeriodicOrbitResult Answer(const Setup& setup, const PeriodicOrbitRequest& request,
                           const Watch& watch = {});

}  // namespace ros_interface
}  // namespace contact_flow
