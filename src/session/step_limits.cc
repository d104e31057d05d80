// SPDX-License-Identifier: BSD-3-Clause
#include "step_limits.h"

#include <time.h>  // clock_gettime

#include <chrono>

namespace contact_flow {

double ProcessorSeconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double SteadySeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Budget ProcessorBudget(double seconds) { return StepClock().OfProcessor(seconds); }

Budget StepClock::Until(const std::function<double()>& clock, double seconds) const {
  BudgetLimits limits;
  limits.look_every = look_every;
  limits.cancelled = [clock, end = clock() + seconds] { return clock() > end; };
  return Budget(limits);
}

}  // namespace contact_flow
