// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ctime>  // clock_gettime

namespace contact_flow {

/// Processor time of this thread [s]: runs side by side do not use up each other's budget.
inline double ThreadSeconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace contact_flow
