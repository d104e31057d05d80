// SPDX-License-Identifier: BSD-3-Clause
// System.simulate_batch: numbers for contact_flow.batch, which makes the Batch.
#include "contact_flow/flow/simulate_batch.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

LaneSet ToLanes(const std::string& name) {
  if (name == "best") return LaneSet::kBest;
  if (name == "none") return LaneSet::kNone;
  if (name == "avx2") return LaneSet::kAvx2;
  if (name == "avx512") return LaneSet::kAvx512;
  throw py::value_error("lanes is '" + name + "': it must be best, none, avx2 or avx512");
}

/// Columns, one a run; one for all where a single input is given.
Matrix ToInputs(const System& system, const py::handle& inputs) {
  if (inputs.is_none() || py::isinstance<py::dict>(inputs)) return ToInput(system, inputs);
  const Array array = ToArray(inputs, "inputs");
  if (array.ndim() == 1) return ToInput(system, inputs);
  return ToMatrix(inputs, "inputs", system.get().num_inputs()).transpose();
}

py::tuple ToEventTuple(const BatchEvent& event, const SystemDescription& names) {
  return py::make_tuple(event.t, ToNames(event.activated, names), ToNames(event.released, names),
                        ToNames(event.mode_after, names), py::cast(event.impulse));
}

py::dict ToColumns(const BatchResult& batch, const MechanicalSystem& system) {
  const auto count = static_cast<Eigen::Index>(batch.runs.size());
  const SystemDescription& names = system.description();
  Matrix final_states(count, system.state_size()), errors(count, 2 * system.dof());
  Vector t_end(count);
  py::list outcomes, messages, modes, events;
  std::vector<bool> alone;
  std::vector<long> steps, evaluations;
  for (Eigen::Index k = 0; k < count; ++k) {
    const BatchRun& run = batch.runs[static_cast<std::size_t>(k)];
    const bool made = run.refused.empty();
    if (made) {
      final_states.row(k) = run.final_state;
      errors.row(k) = run.error;
    } else {
      final_states.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
      errors.row(k).setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    t_end(k) = run.t_end;
    outcomes.append(made ? OutcomeName(run.status.outcome) : "refused");
    messages.append(made ? run.status.message : run.refused);
    modes.append(ToNames(run.first_mode, names));
    py::list passed;
    for (const BatchEvent& event : run.events) passed.append(ToEventTuple(event, names));
    events.append(passed);
    alone.push_back(run.alone);
    steps.push_back(run.statistics.steps);
    evaluations.push_back(run.statistics.field_evaluations);
  }
  using py::literals::operator""_a;
  return py::dict("final_state"_a = final_states, "error"_a = errors, "t_end"_a = t_end,
                  "outcome"_a = outcomes, "message"_a = messages, "first_mode"_a = modes,
                  "events"_a = events, "alone"_a = alone, "steps"_a = steps,
                  "field_evaluations"_a = evaluations, "width"_a = batch.width,
                  "why"_a = batch.why);
}

py::dict RunBatch(const System& system, const py::object& states, const py::object& duration,
                  const py::object& inputs, const py::object& threads, const std::string& lanes,
                  const py::kwargs& options) {
  const SimulateOptions o = ToOptions(options, SimulateOptions());
  const double seconds = ToDuration(system, duration);
  const Matrix x = ToMatrix(states, "states", system.get().state_size()).transpose();
  const Matrix u = ToInputs(system, inputs);
  BatchOptions batch;
  batch.threads = ToCount(threads, "threads");
  batch.lanes = ToLanes(lanes);
  const BatchResult result =
      WithoutLock([&] { return SimulateBatch(system.get(), x, u, seconds, o, batch); });
  return ToColumns(result, system.get());
}

}  // namespace

void BindBatch(py::module_* module) {
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("_simulate_batch", &RunBatch, py::arg("states"), py::arg("duration"), py::arg("inputs"),
           py::arg("threads"), py::arg("lanes"))
      .def(
          "simulate_batch",
          [](const py::object& system, const py::args& arguments, const py::kwargs& keywords) {
            return py::module_::import("contact_flow.batch")
                .attr("simulate_batch")(system, *arguments, **keywords);
          },
          "Many runs from the rows of `states` [runs × nq+d], as a Batch of arrays: several at\n"
          "once in the lanes of AVX2 or AVX-512 where model and machine allow, with the bits of\n"
          "single runs; the arguments are those of contact_flow.simulate_batch behind the "
          "system.");
}

}  // namespace python
}  // namespace contact_flow
