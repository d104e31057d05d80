// SPDX-License-Identifier: BSD-3-Clause
// Events by their names: when they happen in a run, and how people call them.
#include <limits>
#include <sstream>
#include <vector>

#include "contact_flow/trajectory_optimization/piece_models.h"

namespace contact_flow {

double TimeOf(const Trajectory& run, const EventName& event) {
  int left = event.number;
  for (const Transition& transition : run.transitions) {
    const ConstraintSet met = transition.activated | transition.switched;
    if (transition.changes_input || !met.Contains(event.constraint) || left-- > 0) continue;
    for (const EventInstant& instant : transition.instants) {
      if (instant.constraint == event.constraint) return transition.t + instant.offset;
    }
    return transition.t;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

double TimeBetween(const Trajectory& run, const std::vector<double>& grid, const EventName& first,
                   const EventName& second) {
  const auto time = [&](const EventName& event) {
    if (event.constraint >= 0) return TimeOf(run, event);
    const auto instant = static_cast<std::size_t>(event.number);
    return instant < grid.size() ? grid[instant] : std::numeric_limits<double>::quiet_NaN();
  };
  return time(second) - time(first);
}

std::string Describe(const Unknowns& unknowns, const std::vector<double>& grid,
                     const EventName& event) {
  std::ostringstream text;
  text.precision(9);
  if (event.constraint < 0 && event.number == static_cast<int>(grid.size())) {
    text << "the end";
  } else if (event.constraint < 0) {
    text << "the input change at t = " << grid[static_cast<std::size_t>(event.number)] << " s";
  } else {
    const auto& names = unknowns.system().description().constraints;
    text << "touchdown " << event.number + 1 << " of '"
         << names[static_cast<std::size_t>(event.constraint)] << "'";
  }
  return text.str();
}

}  // namespace contact_flow
