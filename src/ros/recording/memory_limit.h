// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace contact_flow {
namespace ros_interface {

/// Least and most that ~max_memory may be [10⁶ byte]. Addresses count, also those that are only
/// reserved: a node begins with about 2000.
inline constexpr double kLeastMemory = 2500, kMostMemory = 1e8;

/// Limits the addresses of this process to so many 10⁶ byte (setrlimit, RLIMIT_AS): what would take
/// more is refused (std::bad_alloc, which every handler and roscpp's reading of messages catch). 0:
/// no limit. -1: what the machine has, but at least kLeastMemory. Does nothing under sanitizers,
/// which reserve terabytes. Returns the limit, 0 for none.
double LimitMemory(double megabytes);

}  // namespace ros_interface
}  // namespace contact_flow
