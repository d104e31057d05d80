// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <time.h>  // clock_gettime, CLOCK_MONOTONIC_COARSE

namespace contact_flow {

/// What this clock shows [s].
inline double SecondsOf(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time of this thread [s]: work side by side does not use up each other's budget, and on
/// a busy machine short work stays short. A call of the system, a third of a microsecond.
inline double ThreadSeconds() { return SecondsOf(CLOCK_THREAD_CPUTIME_ID); }

/// Time as of the last tick, a few milliseconds ago [s]: read in a few nanoseconds.
inline double CoarseSeconds() { return SecondsOf(CLOCK_MONOTONIC_COARSE); }

}  // namespace contact_flow
