// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {
namespace ros_interface {

/// Runs the node until it is told to stop. Returns the exit code of the process: 1 when its
/// parameters are not in order, which is printed.
int RunNode();

}  // namespace ros_interface
}  // namespace contact_flow
