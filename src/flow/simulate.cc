// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/simulate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/flow/flow.h"

namespace contact_flow {
namespace {

constexpr double kTimeRounding = 1e-14;  // of instants, relative
constexpr std::size_t kFewEvents = 3;    // what there is room for at once
/// An instant of the input that is no farther from the end than this, relative, is the end.
constexpr double kAtEnd = 4 * std::numeric_limits<double>::epsilon();

Arc ArcFrom(const Flow& flow) {
  Arc arc;
  arc.mode = flow.mode();
  arc.u = flow.u();
  arc.t_begin = arc.t_end = flow.t();
  arc.x_begin = arc.x_end = flow.x();
  arc.error = Vector::Zero(flow.arc_error().size());
  return arc;
}

/// What a trajectory holds, in bytes.
class TrajectorySize {
 public:
  explicit TrajectorySize(const MechanicalSystem& system, double max_megabytes)
      : allowed_(1e6 * max_megabytes),
        step_(8.0 * (kDenseOrder * system.state_size() + 2)),
        arc_(sizeof(Arc) + sizeof(Transition) +
             8.0 * (10.0 * system.state_size() + 4.0 * system.num_constraints())) {}

  /// These count one more; false, with the reason in the status, when that is too much.
  bool AddStep(Flow* flow) { return Add(step_, flow); }
  bool AddArc(Flow* flow) { return Add(arc_, flow); }

 private:
  bool Add(double bytes, Flow* flow) {
    held_ += bytes;
    if (held_ <= allowed_) return true;
    std::ostringstream reason;
    reason
        << "max_megabytes = " << 1e-6 * allowed_
        << " are full of the motion so far, its steps and its events; options.max_megabytes may be "
           "raised, or fewer samples asked for";
    flow->Stop(Outcome::kBudgetExceeded, reason.str());
    return false;
  }

  const double allowed_, step_, arc_;
  double held_ = 0;
};

/// Flows to the next transition or to `segment_end`, where the input changes. True when a
/// transition was passed.
bool FlowArc(Flow* flow, double segment_end, double horizon, bool dense, TrajectorySize* size,
             Arc* arc) {
  while (flow->t() < segment_end) {
    if (!flow->Propose(horizon)) return false;
    if (dense && flow->proposed_length() > 0) {
      if (!size->AddStep(flow)) return false;
      arc->dense.Append(flow->t(), flow->proposed_length(), flow->ProposedDense(),
                        static_cast<int>(arc->x_begin.size()));
    }
    arc->implicit_steps += flow->ProposesImplicit() && flow->proposed_length() > 0;
    if (flow->proposed_end() > segment_end) {
      if (!flow->Cut(segment_end)) return false;
      arc->t_end = flow->t();
      arc->x_end = flow->x();
      arc->error = flow->arc_error();
      return false;
    }
    arc->t_end = flow->proposed_end();
    arc->x_end = flow->proposed_state();
    const bool passed = flow->Accept();
    arc->error = flow->arc_error();
    if (passed) return true;
    if (!flow->status().ok()) return false;
  }
  return false;
}

}  // namespace

Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                    double duration, const SimulateOptions& options) {
  return Simulate(system, x, InputSchedule::Constant(u), duration, options);
}

Trajectory Simulate(const MechanicalSystem& system, const VectorRef& x,
                    const InputSchedule& schedule, double duration,
                    const SimulateOptions& options) {
  Validate(options);
  Validate(system, schedule);
  if (!(duration >= 0) || !std::isfinite(duration)) {
    std::ostringstream message;
    message << "duration is " << duration << " s: it must be finite and not negative";
    throw std::invalid_argument(message.str());
  }
  const BudgetStage stage("the simulation");
  const ContactMode mode = InitialMode(system, x, schedule.values.front(), options);
  const double begin = schedule.grid.front(), end = begin + duration;
  Flow flow(system, begin, x, mode, schedule.values.front(), options);
  Trajectory trajectory;
  trajectory.simultaneity_tolerance = options.simultaneity_tolerance;
  trajectory.impact_law = options.impact_law;
  trajectory.method = options.method;
  trajectory.absolute_tolerance = options.absolute_tolerance;
  trajectory.gap_tolerance = options.gap_tolerance;
  trajectory.speed_tolerance = options.speed_tolerance;
  trajectory.arcs.reserve(kFewEvents + 1);
  trajectory.transitions.reserve(kFewEvents);
  trajectory.arcs.push_back(ArcFrom(flow));
  TrajectorySize size(system, options.max_megabytes);
  std::size_t next = 1;  // of the schedule
  const double same = kAtEnd * std::max(std::abs(begin), std::abs(end));
  try {
    while (flow.status().ok() && flow.t() < end) {
      const bool changes = next < schedule.grid.size() && schedule.grid[next] < end - same;
      const double segment_end = changes ? schedule.grid[next] : end;
      const bool passed =
          FlowArc(&flow, segment_end, end, options.dense, &size, &trajectory.arcs.back()) ||
          (changes && flow.status().ok() &&
           (flow.EndSlips() || (flow.status().ok() && flow.ChangeInput(schedule.values[next++]))));
      if (!passed || !size.AddArc(&flow)) break;
      trajectory.transitions.push_back(flow.transition());
      trajectory.arcs.push_back(ArcFrom(flow));
    }
  } catch (const BudgetExceeded& reason) {
    flow.Stop(OutcomeOf(reason), reason.what());
  }
  if (options.simultaneity_tolerance == 0) {
    double& tolerance = trajectory.simultaneity_tolerance;
    tolerance = kTimeRounding * std::max(std::abs(flow.t()), flow.t() - begin);
    for (const Transition& passed : trajectory.transitions) {
      tolerance = std::max(tolerance, passed.tolerance);
    }
  }
  if (next < schedule.grid.size() && flow.status().ok()) {
    trajectory.input_changes_at_end =
        schedule.grid[next] <= end + same && schedule.values[next] != schedule.values[next - 1];
  }
  trajectory.status = flow.status();
  trajectory.warnings = flow.warnings();
  trajectory.num_warnings = flow.num_warnings();
  trajectory.margins = flow.margins();
  trajectory.statistics = flow.statistics();
  trajectory.accumulation_time = flow.accumulation_time();
  return trajectory;
}

}  // namespace contact_flow
