// SPDX-License-Identifier: BSD-3-Clause
#include "memory_limit.h"

#include <ros/console.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace contact_flow {
namespace ros_interface {

double LimitMemory([[maybe_unused]] double megabytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  return 0;
#else
  if (megabytes == 0) return 0;
  if (megabytes < 0) {
    const double pages = static_cast<double>(sysconf(_SC_PHYS_PAGES));
    megabytes = std::max(1e-6 * pages * static_cast<double>(sysconf(_SC_PAGESIZE)), kLeastMemory);
  }
  rlimit limit{};
  if (getrlimit(RLIMIT_AS, &limit) != 0) return 0;
  const rlim_t asked = static_cast<rlim_t>(megabytes * 1e6);
  limit.rlim_cur = limit.rlim_max == RLIM_INFINITY ? asked : std::min(asked, limit.rlim_max);
  if (setrlimit(RLIMIT_AS, &limit) != 0) {
    ROS_WARN("max_memory: %s; going on without", std::strerror(errno));
    return 0;
  }
  return 1e-6 * static_cast<double>(limit.rlim_cur);
#endif
}

}  // namespace ros_interface
}  // namespace contact_flow
