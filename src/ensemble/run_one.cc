// SPDX-License-Identifier: BSD-3-Clause
#include "run_one.h"

#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/flow/simulate_batch.h"
#include "contact_flow/nearest_name.h"
#include "src/flow/lane_set.h"

namespace contact_flow {
namespace {

const InputSchedule& Checked(const SweepRequest& request) {
  if (request.inputs.values.empty()) throw std::invalid_argument("a sweep needs inputs");
  return request.inputs;
}

/// A schedule of several inputs has no one value that a draw could replace: draws add to all.
Vector BaseInput(const SweepRequest& request) {
  const InputSchedule& inputs = Checked(request);
  if (inputs.values.size() == 1) return inputs.values.front();
  return Vector::Zero(inputs.values.front().size());
}

/// Observables are asked for by their names.
void CheckNames(const std::vector<std::string>& observables) {
  std::set<std::string> seen;
  for (const std::string& name : observables) {
    if (!name.empty() && seen.insert(name).second) continue;
    throw std::invalid_argument("the cost " + QuoteName(name) +
                                " needs a name that no other observable has");
  }
}

RunEnd EndOf(const Trajectory& run, int num_constraints) {
  RunEnd end;
  end.status = run.status;
  end.x = run.FinalState();
  end.t = run.t_end();
  end.u = run.arcs.front().u;
  end.margins = run.margins;
  end.word = ModeWord(run, num_constraints);
  for (const Transition& passed : run.transitions) end.event_times.push_back(passed.t);
  return end;
}

RunEnd EndOf(BatchRun&& run, const VectorRef& u, int num_constraints) {
  RunEnd end;
  end.status = std::move(run.status);
  end.x = std::move(run.final_state);
  end.t = run.t_end;
  end.u = u;
  end.margins = run.margins;
  std::vector<ContactMode> modes = {run.first_mode};
  for (const BatchEvent& passed : run.events) {
    modes.push_back(passed.mode_after);
    end.event_times.push_back(passed.t);
  }
  end.word = ModeWord(modes, num_constraints);
  return end;
}

}  // namespace

std::vector<std::string> ObservableNames(const MechanicalSystem& system, const Keep& keep) {
  std::vector<std::string> names = EnsembleTangentNames(system.description());
  for (const CostTerm& cost : keep.costs) names.push_back(cost.name);
  return names;
}

Vector ReferenceState(const SweepRequest& request) {
  SimulateOptions options = request.options;
  options.dense = false;
  try {
    const Trajectory run =
        Simulate(*request.system, request.x, request.inputs, request.duration, options);
    if (run.FinalState().allFinite()) return run.FinalState();
  } catch (const BudgetExceeded&) {
    throw;
  } catch (const std::exception&) {  // not admissible: what the draws make of it may be
  }
  return request.x;
}

RunOne::RunOne(const SweepRequest& request, Vector reference)
    : request_(request),
      sampler_(request.draws),
      start_(*request.system, sampler_.names(), request.x, BaseInput(request)),
      recorder_(*request.system, request.keep, sampler_.names(), Checked(request).grid.front(),
                request.duration),
      reference_(std::move(reference)),
      options_(request.options) {
  CheckNames(ObservableNames(*request.system, request.keep));
  if (start_.ReplacesInputs() && request.inputs.values.size() > 1) {
    throw std::invalid_argument(
        "the inputs change on a grid: draw '+' and the name, which is added on all of it");
  }
  if (start_.ChangesParameters() && !request.make) {
    throw std::invalid_argument("parameters are drawn, but the system cannot be made anew");
  }
  if (!request.keep.derivative.variables.parameters.empty() ||
      request.keep.derivative.variables.inputs) {
    throw std::invalid_argument("derivatives of a sweep are by the initial state");
  }
  options_.dense = recorder_.NeedsDense();
  has_lanes_ = !options_.dense && !start_.ChangesParameters() && ConstantFromZero() &&
               LanesOfSystem(*request.system, options_, request.lanes).available();
  MakeSummary();  // checks the histograms
}

Summary RunOne::MakeSummary() const {
  return Summary(2 * request_.system->dof() + static_cast<int>(request_.keep.costs.size()),
                 request_.histograms);
}

void RunOne::Run(std::uint64_t run, std::size_t row, Scratch* scratch, Columns* columns,
                 Summary* summary) const {
  try {
    RunDrawn(run, row, scratch, columns, summary);
    return;
  } catch (const BudgetExceeded& reason) {
    if (scratch->budget.cancelled()) return;  // of the sweep: the block is dropped
    const Outcome outcome = OutcomeOf(reason);
    recorder_.WriteOutcome(static_cast<int>(outcome), row, columns);
    summary->AddUnmeasured(run, static_cast<int>(outcome), "", reason.what());
  } catch (const std::exception& reason) {
    recorder_.WriteOutcome(kThrew, row, columns);
    summary->AddUnmeasured(run, kThrew, "", reason.what());
  } catch (...) {
    recorder_.WriteOutcome(kThrew, row, columns);
    summary->AddUnmeasured(run, kThrew, "", "not a std::exception");
  }
}

const MechanicalSystem& RunOne::SystemOf(Scratch* scratch) const {
  if (!start_.ChangesParameters()) return *request_.system;
  if (scratch->system == nullptr || scratch->parameters != scratch->start.parameters) {
    scratch->system = nullptr;  // not that of before, where this one is refused
    scratch->system = request_.make(scratch->start.parameters);
    scratch->parameters = scratch->start.parameters;
  }
  return *scratch->system;
}

void RunOne::RunDrawn(std::uint64_t run, std::size_t row, Scratch* scratch, Columns* columns,
                      Summary* summary) const {
  sampler_.Draw(run, &scratch->drawn);
  recorder_.WriteStart(scratch->drawn, row, columns);
  start_.Apply(scratch->drawn, &scratch->start);
  Trajectory trajectory;
  const MechanicalSystem* system = nullptr;
  try {
    system = &SystemOf(scratch);
    if (ConstantFromZero()) {
      trajectory =
          Simulate(*system, scratch->start.x, scratch->start.u, request_.duration, options_);
    } else {
      InputSchedule inputs = request_.inputs;
      for (Vector& u : inputs.values) {
        u = inputs.values.size() == 1 ? scratch->start.u : Vector(u + scratch->start.u);
      }
      trajectory = Simulate(*system, scratch->start.x, inputs, request_.duration, options_);
    }
  } catch (const std::invalid_argument& reason) {
    Refuse(run, reason.what(), row, columns, summary);
    return;
  }
  const RunEnd end = EndOf(trajectory, system->num_constraints());
  recorder_.WriteEnd(end, row, columns);
  if (request_.keep.Differentiates()) {  // the run's own limit holds for its derivative, too
    BudgetLimits limits;
    limits.max_seconds = options_.max_seconds;
    limits.max_megabytes = options_.max_megabytes;
    limits.cancelled = [scratch] { return scratch->budget.cancelled(); };
    const BudgetScope scope{Budget(limits)};
    recorder_.WriteMotion(*system, trajectory, row, columns);
  } else {
    recorder_.WriteMotion(*system, trajectory, row, columns);
  }
  Count(*system, run, end, row, columns, summary);
}

bool RunOne::ConstantFromZero() const {
  return request_.inputs.values.size() == 1 && request_.inputs.grid.front() == 0;
}

void RunOne::Refuse(std::uint64_t run, const std::string& reason, std::size_t row, Columns* columns,
                    Summary* summary) const {
  recorder_.WriteOutcome(kInadmissible, row, columns);
  summary->AddUnmeasured(run, kInadmissible, "", reason);
}

void RunOne::Count(const MechanicalSystem& system, std::uint64_t run, const RunEnd& end,
                   std::size_t row, Columns* columns, Summary* summary) const {
  if (!end.status.ok()) {
    summary->AddUnmeasured(run, static_cast<int>(end.status.outcome), end.word, end.status.message);
    return;
  }
  const Vector costs = recorder_.Costs(end.x, end.u);
  Vector y(2 * system.dof() + costs.size());
  y << system.Separation(end.x, reference_), costs;
  if (y.allFinite()) {
    summary->AddMeasured(y, end.word);
    return;
  }
  // A cost that overflows would make every mean NaN.
  const std::vector<std::string> names = ObservableNames(system, request_.keep);
  Eigen::Index k = 0;
  while (std::isfinite(y(k))) ++k;
  recorder_.WriteOutcome(static_cast<int>(Outcome::kNonFinite), row, columns);
  summary->AddUnmeasured(
      run, static_cast<int>(Outcome::kNonFinite), end.word,
      "the observable '" + names[static_cast<std::size_t>(k)] + "' is not finite");
}

bool RunOne::RunLanes(std::uint64_t first, std::size_t row, std::size_t count, Scratch* scratch,
                      Columns* columns, Summary* summary) const {
  const MechanicalSystem& system = *request_.system;
  const auto runs = static_cast<Eigen::Index>(count);
  Matrix drawn(static_cast<Eigen::Index>(sampler_.names().size()), runs);
  Matrix states(system.state_size(), runs), inputs(system.num_inputs(), runs);
  BatchResult batch;
  try {
    for (Eigen::Index k = 0; k < runs; ++k) {
      sampler_.Draw(first + static_cast<std::uint64_t>(k), &scratch->drawn);
      start_.Apply(scratch->drawn, &scratch->start);
      drawn.col(k) = scratch->drawn;
      states.col(k) = scratch->start.x;
      inputs.col(k) = scratch->start.u;
    }
    batch = SimulateBatch(system, states, inputs, request_.duration, options_, {1, request_.lanes});
  } catch (const std::exception&) {  // of which run is not known: each comes by itself
    return false;
  }
  if (scratch->budget.cancelled()) return false;
  for (std::size_t k = 0; k < count; ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    recorder_.WriteStart(drawn.col(column), row + k, columns);
    if (!batch.runs[k].refused.empty()) {
      Refuse(first + k, batch.runs[k].refused, row + k, columns, summary);
      continue;
    }
    const RunEnd end =
        EndOf(std::move(batch.runs[k]), inputs.col(column), system.num_constraints());
    recorder_.WriteEnd(end, row + k, columns);
    Count(system, first + k, end, row + k, columns, summary);
  }
  return true;
}

}  // namespace contact_flow
