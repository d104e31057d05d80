// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/Policy.h"
#include "contact_flow/trajectory_optimization/policy.h"

namespace contact_flow {
namespace ros_interface {

/// A policy as a message (header empty), to the bit.
Policy ToMsg(const TrackingPolicy& policy);
/// And back. Throws std::invalid_argument, naming field and value, for one that is not in order.
TrackingPolicy FromMsg(const Policy& message);

}  // namespace ros_interface
}  // namespace contact_flow
