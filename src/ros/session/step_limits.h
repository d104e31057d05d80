// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>
#include <time.h>

#include <limits>

#include "contact_flow/budget.h"

/// What one instant of a simulation may take, so that whoever runs it goes on answering.
namespace contact_flow {
namespace ros_interface {

/// Shutdown has begun. ros::ok() says so only when it is over, and it waits for the callbacks that
/// run: whoever asks ros::ok() in one of them holds it up for ever.
inline bool IsStopping() { return ros::isShuttingDown(); }

/// Processor time of this thread [s]: a process that was stopped for a while has used none.
inline double ProcessorSeconds() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// A budget of this thread's processor time from now on [s].
inline Budget ProcessorBudget(double seconds) {
  BudgetLimits limits;
  const double end = ProcessorSeconds() + seconds;
  limits.cancelled = [end] { return ProcessorSeconds() > end; };
  return Budget(limits);
}

struct StepLimits {
  /// For kInstant of simulated time [s of processor time]: an epoch that takes more has
  /// come to its end.
  double step_seconds = std::numeric_limits<double>::infinity();
  static constexpr double kInstant = 1e-2;
  /// After which an instant that is not done yet gives way to commands [s].
  double slice_seconds = std::numeric_limits<double>::infinity();
  /// For the rolling derivative of one instant: a mark that takes more is lost.
  double mark_seconds = std::numeric_limits<double>::infinity();
};

}  // namespace ros_interface
}  // namespace contact_flow
