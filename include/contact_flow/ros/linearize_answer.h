// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/LinearizeTrajectory.h"
#include "contact_flow/ros/setup.h"

namespace contact_flow {
namespace ros_interface {

/// Answers the service linearize; throws std::invalid_argument, naming the field, for a bad request.
void Answer(const Setup& setup, const LinearizeTrajectory::Request& request,
            LinearizeTrajectory::Response* response);

}  // namespace ros_interface
}  // namespace contact_flow
