// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>

#include "contact_flow/budget.h"

/// What one instant of a simulation may take, so that whoever runs it goes on answering.
namespace contact_flow {

/// Processor time of this thread [s]: a process that was stopped for a while has used none.
double ProcessorSeconds();
/// By a clock that never goes back [s].
double SteadySeconds();

/// A budget of this thread's processor time from now on [s].
Budget ProcessorBudget(double seconds);

/// What limits are measured by. Nothing but these limits depends on it: a test counts how often it
/// is asked in place of time, and has the same verdict on every machine.
struct StepClock {
  std::function<double()> processor = &ProcessorSeconds;  ///< work that is done [s]
  std::function<double()> wall = &SteadySeconds;          ///< while others wait [s]
  double look_every = BudgetLimits().look_every;          ///< by the budgets below [s of real time]

  /// Budgets of so many seconds from now on, by either.
  Budget OfProcessor(double seconds) const { return Until(processor, seconds); }
  Budget OfWall(double seconds) const { return Until(wall, seconds); }

 private:
  Budget Until(const std::function<double()>& clock, double seconds) const;
};

/// The limits of a session.
struct StepLimits {
  /// For kInstant of simulated time [s of processor time]: an epoch that takes more has
  /// come to its end.
  double step_seconds = std::numeric_limits<double>::infinity();
  static constexpr double kInstant = 1e-2;
  /// After which an instant that is not done yet gives way to commands [s].
  double slice_seconds = std::numeric_limits<double>::infinity();
  /// For the rolling derivative of one instant: a mark that takes more is lost
  /// [s of processor time].
  double mark_seconds = std::numeric_limits<double>::infinity();
};

}  // namespace contact_flow
