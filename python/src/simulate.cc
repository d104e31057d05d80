// SPDX-License-Identifier: BSD-3-Clause
// System.simulate, and Runs as values: pickled as the request that repeats them.
#include "convert.h"
#include "run.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

std::shared_ptr<Run> Repeat(std::shared_ptr<const System> system, Vector x0, InputSchedule inputs,
                            double duration, const SimulateOptions& options) {
  auto run = std::make_shared<Run>();
  run->system = std::move(system);
  run->x0 = std::move(x0);
  run->inputs = std::move(inputs);
  run->duration = duration;
  run->options = options;
  run->trajectory = WithoutLock([&] {
    return Simulate(run->system->get(), run->x0, run->inputs, run->duration, run->options);
  });
  return run;
}

std::shared_ptr<Run> SimulateSystem(const std::shared_ptr<System>& system, const py::object& x0,
                                    const py::object& duration, const py::object& inputs,
                                    const py::kwargs& options) {
  const SimulateOptions o = ToOptions(options, SimulateOptions());
  const double seconds = ToDuration(*system, duration);
  return Repeat(system, ToState(*system, x0), ToSchedule(*system, inputs), seconds, o);
}

py::tuple RunState(const Run& run) {
  run.CheckRepeats("it cannot be pickled");
  Matrix values(run.inputs.values.size(), run.system->get().num_inputs());
  for (std::size_t k = 0; k < run.inputs.values.size(); ++k) {
    values.row(static_cast<Eigen::Index>(k)) = run.inputs.values[k].transpose();
  }
  return py::make_tuple(std::const_pointer_cast<System>(run.system), run.x0, run.inputs.grid,
                        values, run.duration, ToDict(run.options));
}

std::shared_ptr<Run> RunFrom(const py::tuple& state) {
  const auto system = state[0].cast<std::shared_ptr<System>>();
  InputSchedule inputs;
  inputs.grid = state[2].cast<std::vector<double>>();
  const Matrix values = ToMatrix(state[3], "inputs.u", system->get().num_inputs());
  for (Eigen::Index k = 0; k < values.rows(); ++k) {
    inputs.values.push_back(values.row(k).transpose());
  }
  return Repeat(system, ToVector(state[1], "x0", -1), inputs, state[4].cast<double>(),
                ToOptions(py::kwargs(state[5]), SimulateOptions()));
}

}  // namespace

void BindSimulate(py::module_* module) {
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("simulate", &SimulateSystem, py::arg("x0") = py::none(),
           py::arg("duration") = py::none(), py::arg("inputs") = py::none(),
           "The motion from x0 = (q, v) [nq+d] for `duration` seconds, as a Run.\n\n"
           "x0: numbers, or a dict of some of them by name over the nominal state.\n"
           "inputs: a constant u [m], a dict by name, or Grid(t, U), constant on intervals.\n"
           "What is left out is that of the nominal run. Options are those of C++'s\n"
           "SimulateOptions, by name: relative_tolerance, absolute_tolerance, max_step,\n"
           "simultaneity_tolerance, gap_tolerance, speed_tolerance, zeno_interval, complete_zeno,\n"
           "max_steps, max_events, max_seconds, max_megabytes, impact_law, method, dense.\n"
           "ValueError for sizes, numbers that are not finite and states that penetrate; how the\n"
           "run came out is its status.");
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def(
          "sweep",
          [](const py::object& system, const py::args& arguments, const py::kwargs& keywords) {
            return py::module_::import("contact_flow.ensemble")
                .attr("sweep")(system, *arguments, **keywords);
          },
          "Many runs, from starts, inputs and parameters that are drawn, as an Ensemble;\n"
          "the arguments are those of contact_flow.sweep behind the system.");
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def(
          "report",
          [](const py::object& run, const py::object& path, const py::object& by, int samples) {
            py::module_::import("contact_flow.report").attr("write_report")(run, path, by, samples);
          },
          py::arg("path"), py::arg("by") = py::make_tuple("state"), py::arg("samples") = 600,
          "Writes the run as one HTML file that needs no network: contacts, events, states, "
          "forces,\n"
          "derivative, margins; see contact_flow.write_report.")
      .def(py::pickle(&RunState, &RunFrom))
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; });
}

}  // namespace python
}  // namespace contact_flow
