// SPDX-License-Identifier: BSD-3-Clause
#include "run_one.h"

#include <stdexcept>
#include <utility>

#include "contact_flow/budget.h"

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
  } catch (const std::exception&) {   // not admissible: what the draws make of it may be
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
  MakeSummary();   // checks the histograms
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
    if (scratch->budget.cancelled()) return;   // of the sweep: the block is dropped
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
    scratch->system = nullptr;   // not that of before, where this one is refused
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
    if (request_.inputs.values.size() == 1 && request_.inputs.grid.front() == 0) {
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
    recorder_.WriteOutcome(kInadmissible, row, columns);
    summary->AddUnmeasured(run, kInadmissible, "", reason.what());
    return;
  }
  const std::string word = ModeWord(trajectory, system->num_constraints());
  if (request_.keep.Differentiates()) {   // the run's own limit holds for its derivative, too
    BudgetLimits limits;
    limits.max_seconds = options_.max_seconds;
    limits.cancelled = [scratch] { return scratch->budget.cancelled(); };
    const BudgetScope scope{Budget(limits)};
    recorder_.WriteRun(*system, trajectory, word, row, columns);
  } else {
    recorder_.WriteRun(*system, trajectory, word, row, columns);
  }
  if (!trajectory.status.ok()) {
    summary->AddUnmeasured(run, static_cast<int>(trajectory.status.outcome), word,
                           trajectory.status.message);
    return;
  }
  const Vector costs = recorder_.Costs(trajectory.FinalState(), trajectory.arcs.front().u);
  Vector y(2 * system->dof() + costs.size());
  y << system->Separation(trajectory.FinalState(), reference_), costs;
  summary->AddMeasured(y, word);
}

}  // namespace contact_flow
