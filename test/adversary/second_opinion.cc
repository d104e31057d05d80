// SPDX-License-Identifier: BSD-3-Clause
#include <sstream>
#include <stdexcept>

#include "contact_flow/flow/simulate.h"
#include "test/adversary/judge.h"
#include "test/adversary/tell.h"

namespace contact_flow {
namespace adversary {

std::string SecondOpinion(const Case& c, const Vector& w, const Vector& prediction, double alpha) {
  const int d = c.system->dof();
  const RescaledSystem given(*c.system, c.units);
  if (!w.tail(2).isZero(0)) return "";
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-13;
  options.simultaneity_tolerance = 1e-13;
  options.gap_tolerance = 1e-12;
  options.speed_tolerance = 1e-10;
  options.impact_law = c.options.impact_law;
  options = c.units.Scale(options);
  options.relative_tolerance = 1e-13;
  InputSchedule schedule = c.schedule, moved = c.schedule;
  for (double& t : schedule.grid) t *= c.units.time;
  moved.grid = schedule.grid;
  for (Vector& u : moved.values) u += alpha * w.segment(2 * d, c.system->num_inputs());
  std::ostringstream text;
  try {
    const double duration = c.duration * c.units.time;
    const Trajectory base = Simulate(given, c.units.State(c.x), schedule, duration, options);
    const Trajectory run =
        Simulate(given, c.units.State(c.x + alpha * w.head(2 * d)), moved, duration, options);
    if (!base.status.ok() || !run.status.ok()) return "own runs: " + run.status.message;
    const Vector quotient =
        (c.units.Back(run.FinalState()) - c.units.Back(base.FinalState())) / alpha;
    text << "own quotient off by " << (quotient - prediction).cwiseAbs().maxCoeff()
         << ", its transitions" << Events(c, run);
  } catch (const std::invalid_argument& error) {
    return std::string("own run: ") + error.what();
  }
  return text.str();
}

}  // namespace adversary
}  // namespace contact_flow
