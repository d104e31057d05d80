// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/input_schedule.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

namespace contact_flow {

void Validate(const MechanicalSystem& system, const InputSchedule& schedule) {
  std::ostringstream message;
  if (schedule.grid.empty() || schedule.grid.size() != schedule.values.size()) {
    message << "the input schedule has " << schedule.grid.size() << " instants and "
            << schedule.values.size() << " inputs: as many of each are needed, and at least one";
    throw std::invalid_argument(message.str());
  }
  for (std::size_t k = 0; k < schedule.grid.size(); ++k) {
    const double t = schedule.grid[k];
    if (!std::isfinite(t) || (k > 0 && !(t > schedule.grid[k - 1]))) {
      message << "the input grid's instant " << k << " is " << t << " s: it must be finite"
              << (k > 0 ? " and later than the one before" : "");
      throw std::invalid_argument(message.str());
    }
    const Vector& u = schedule.values[k];
    if (u.size() != system.num_inputs()) {
      message << "the input u";
      if (k > 0) message << " of interval " << k;
      message << " has " << u.size() << " entries: " << system.num_inputs() << " are needed";
      throw std::invalid_argument(message.str());
    }
    for (Eigen::Index i = 0; i < u.size(); ++i) {
      if (std::isfinite(u(i))) continue;
      message << "input '" << system.description().inputs[i] << "' of interval " << k << " is "
              << u(i) << ": it must be finite";
      throw std::invalid_argument(message.str());
    }
  }
}

}  // namespace contact_flow
