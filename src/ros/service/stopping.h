// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

namespace contact_flow {
namespace ros_interface {

/// Shutdown has begun. ros::ok() says so only when it is over, and it waits for the callbacks that
/// run: whoever asks ros::ok() in one of them holds it up for ever.
inline bool IsStopping() { return ros::isShuttingDown(); }

}  // namespace ros_interface
}  // namespace contact_flow
