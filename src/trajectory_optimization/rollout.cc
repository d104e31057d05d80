// SPDX-License-Identifier: BSD-3-Clause
#include "rollout.h"

#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// Behind what is met at an instant, within the tolerance of gaps, at 0.1 m/s or more [s].
constexpr double kBehind = 1e-8;

/// Whether no run may begin here, as in an instant a contact is met.
bool IsAboutToTouch(const MechanicalSystem& system, const Vector& x, const Vector& u,
                    const SimulateOptions& options) {
  try {
    InitialMode(system, x, u, options);
    return false;
  } catch (const std::invalid_argument&) {
    return true;
  }
}

}  // namespace

Rollout RollOut(const std::shared_ptr<const MechanicalSystem>& system, PolicyTracker* tracker,
                const std::vector<double>& times, double end, const Vector& x,
                const SimulateOptions& options) {
  const int nq = system->num_positions(), d = system->dof();
  const ConstraintSet instants = DrivenSwitches(*system, x.head(nq), x.tail(d));
  Rollout out;
  out.changes.assign(static_cast<std::size_t>(system->num_constraints()), 0);
  out.inputs.grid = times;
  out.inputs.values.push_back(tracker->Input(times.front(), x));
  OnlineFlow flow(system, times.front(), x, out.inputs.values.front(), options);
  const auto advance = [&](double t) {
    while (flow.AdvanceTo(t)) {
      AskBudget();
      const Transition& event = flow.transition();
      const ConstraintSet down = (event.activated | event.switched) - instants;
      const ConstraintSet up = event.released - instants;
      if ((down | up).Empty()) continue;
      for (int i : down) ++out.changes[static_cast<std::size_t>(i)];
      for (int i : up) ++out.changes[static_cast<std::size_t>(i)];
      tracker->Observe(event.t, down, up, event.mode_after);
    }
    return flow.status().ok();
  };
  for (std::size_t k = 1; k < times.size() && advance(times[k]); ++k) {
    out.inputs.values.push_back(tracker->Input(times[k], flow.State()));
    flow.SetInput(times[k], out.inputs.values.back());
  }
  advance(end);
  if (flow.status().ok() && IsAboutToTouch(*system, flow.State(), flow.NextInput(), options)) {
    advance(end + kBehind);
  }
  out.status = flow.status();
  out.x = flow.State();
  out.mode = flow.mode();
  return out;
}

}  // namespace contact_flow
