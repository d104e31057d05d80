// SPDX-License-Identifier: BSD-3-Clause
// Run: the motion at any time, its arcs and events, and how near it came to something worse.
#include "run.h"

#include <fstream>
#include <sstream>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/io/samples.h"
#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows between two looks for Ctrl-C.
constexpr Eigen::Index kAskEvery = 1024;

void CheckInside(const Run& run, double t) {
  const Trajectory& trajectory = run.trajectory;
  if (t >= trajectory.t_begin() && t <= trajectory.t_end()) return;
  throw py::value_error("t is " + Number(t) + " s, outside the run, " +
                        Number(trajectory.t_begin()) + " to " + Number(trajectory.t_end()) + " s");
}

/// f(t): a vector of `size` for a number, one row an instant for an array of them.
template <class F>
py::object AtTimes(const Run& run, const py::object& t, Eigen::Index size, F&& f) {
  const Array times = ToArray(t, "t");
  if (times.ndim() > 1) throw py::value_error("t has more than one dimension");
  const Eigen::Index count = times.size();
  const double* at = times.data();
  for (Eigen::Index k = 0; k < count; ++k) CheckInside(run, at[k]);
  if (times.ndim() == 0) {
    py::array_t<double> x(size);
    Eigen::Map<Vector>(x.mutable_data(), size) = f(at[0]);
    return std::move(x);
  }
  py::array_t<double> x({count, size});
  Eigen::Map<RowMajor> rows(x.mutable_data(), count, size);
  WithoutLock([&] {
    for (Eigen::Index k = 0; k < count; ++k) {
      if (k % kAskEvery == 0) AskBudget();
      rows.row(k) = f(at[k]).transpose();
    }
    return 0;
  });
  return std::move(x);
}

py::object State(const Run& run, const py::object& t) {
  if (!run.options.dense) throw py::value_error("the run was made with dense=False");
  return AtTimes(run, t, run.system->get().state_size(),
                 [&](double at) { return run.trajectory.State(at); });
}

py::object Force(const Run& run, const py::object& t) {
  if (!run.options.dense) throw py::value_error("the run was made with dense=False");
  const MechanicalSystem& system = run.system->get();
  ContactDynamics dynamics(system, system.nominal().u);
  return AtTimes(run, t, system.num_rows(), [&](double at) {
    const Arc& arc = run.trajectory.arcs[static_cast<std::size_t>(run.trajectory.ArcAt(at))];
    dynamics.SetInput(arc.u);
    dynamics.Evaluate(run.trajectory.State(at), arc.mode);
    return Vector(dynamics.force());
  });
}

py::object Input(const Run& run, const py::object& t) {
  return AtTimes(run, t, run.system->get().num_inputs(), [&](double at) {
    return run.trajectory.arcs[static_cast<std::size_t>(run.trajectory.ArcAt(at))].u;
  });
}

template <class Part>
py::tuple Parts(const std::shared_ptr<Run>& run, std::size_t count) {
  py::tuple parts(count);
  for (std::size_t k = 0; k < count; ++k) parts[k] = py::cast(Part{run, k});
  return parts;
}

std::vector<std::string> Words(const Run& run) {
  std::vector<std::string> words;
  for (ContactMode mode : run.trajectory.ModeSequence()) {
    words.push_back(mode.Word(run.system->get().num_constraints()));
  }
  return words;
}

void CheckCount(const Run& run, int count) {
  if (count < 1) throw py::value_error("count is " + std::to_string(count) + ", expected ≥ 1");
  const double megabytes = 8e-6 * count * (run.system->get().state_size() + 1);
  if (megabytes > run.options.max_megabytes) {
    throw py::value_error("count is " + std::to_string(count) + ", whose rows take " +
                          Number(megabytes) + " MB, more than the run's max_megabytes, " +
                          Number(run.options.max_megabytes));
  }
}

py::tuple Sampled(const Run& run, int count) {
  CheckCount(run, count);
  if (count > 1 && !run.options.dense) throw py::value_error("the run was made with dense=False");
  const Samples samples = WithoutLock([&] { return SampleTrajectory(run.trajectory, count); });
  return py::make_tuple(Vector(Eigen::Map<const Vector>(
                            samples.t.data(), static_cast<Eigen::Index>(samples.t.size()))),
                        RowMajor(samples.x));
}

std::string Csv(const Run& run, int count) {
  CheckCount(run, count);
  return WithoutLock([&] {
    std::ostringstream text;
    WriteCsv(run.description(), run.trajectory, count, &text);
    return text.str();
  });
}

std::string RunRepr(const Run& run) {
  const Trajectory& t = run.trajectory;
  return "<Run of " + run.description().name + ", " + Number(t.t_begin()) + " to " +
         Number(t.t_end()) + " s, " + std::to_string(t.transitions.size()) + " event" +
         (t.transitions.size() == 1 ? "" : "s") + ": " + OutcomeName(t.status.outcome) + ">";
}

void BindParts(py::module_* module) {
  py::class_<Margins>(*module, "Margins",
                      "How close a run came to an event that did not happen, or happened badly;\n"
                      "infinite where nothing of the kind occurred.")
      .def_readonly("approach_speed", &Margins::approach_speed, "min |Da_i v⁻| [m/s]")
      .def_readonly("release_rate", &Margins::release_rate, "min |dλ_i/dt| over releases [N/s]")
      .def_readonly("gap", &Margins::gap, "Smallest gap that stayed open [m].")
      .def_readonly("force", &Margins::force, "Smallest force that kept pushing [N].")
      .def_readonly("event_interval", &Margins::event_interval, "Between two transitions [s].")
      .def_readonly("cluster_spread", &Margins::cluster_spread, "Largest of a cluster [s].")
      .def_readonly(
          "painleve", &Margins::painleve,
          "With friction: least det(A M⁻¹ W) of what slips, over the same without: below 0\n"
          "forces are not unique, or none exist.")
      .def(PickledFields(&Margins::approach_speed, &Margins::release_rate, &Margins::gap,
                         &Margins::force, &Margins::event_interval, &Margins::cluster_spread,
                         &Margins::painleve))
      .def("__repr__", [](const Margins& m) {
        return "<Margins approach_speed " + Number(m.approach_speed) + ", release_rate " +
               Number(m.release_rate) + ", gap " + Number(m.gap) + ", force " + Number(m.force) +
               ", event_interval " + Number(m.event_interval) + ">";
      });
  py::class_<RunStatistics>(*module, "RunStatistics", "How much work a run took.")
      .def_readonly("field_evaluations", &RunStatistics::field_evaluations, "Right-hand sides.")
      .def_readonly("steps", &RunStatistics::steps, "Accepted steps of the integrator.")
      .def_readonly("rejected_steps", &RunStatistics::rejected_steps,
                    "Steps that were made again, shorter.")
      .def_readonly("implicit_steps", &RunStatistics::implicit_steps,
                    "Accepted ones of the implicit method.")
      .def_readonly("jacobians", &RunStatistics::jacobians,
                    "Of the right-hand side, for that method.")
      .def(PickledFields(&RunStatistics::field_evaluations, &RunStatistics::steps,
                         &RunStatistics::rejected_steps, &RunStatistics::implicit_steps,
                         &RunStatistics::jacobians))
      .def("__repr__", [](const RunStatistics& s) {
        return "<RunStatistics " + std::to_string(s.field_evaluations) + " right-hand sides, " +
               std::to_string(s.steps) + " steps>";
      });
}

}  // namespace

void BindRun(py::module_* module) {
  BindParts(module);
  py::class_<Run, std::shared_ptr<Run>>(
      *module, "Run",
      "A simulated run: arcs of motion separated by events. As a function of time it is\n"
      "left-continuous: at an event it has the value before the impact. It pickles as the request\n"
      "that repeats it, to the bit.")
      .def_property_readonly(
          "status", [](const Run& r) { return r.trajectory.status; },
          "How it ended: true where all is well.")
      .def_property_readonly(
          "system", [](const Run& r) { return std::const_pointer_cast<System>(r.system); },
          "Whose run it is.")
      .def_property_readonly(
          "x0", [](const py::object& self) { return View(self.cast<Run&>().x0, self); },
          "As it was asked for [nq+d], a read-only view.")
      .def_property_readonly(
          "t_begin", [](const Run& r) { return r.trajectory.t_begin(); }, "[s]")
      .def_property_readonly(
          "t_end", [](const Run& r) { return r.trajectory.t_end(); }, "[s]")
      .def_readonly("duration", &Run::duration, "As it was asked for [s].")
      .def_property_readonly(
          "input_grid",
          [](const Run& r) {
            Matrix values(r.inputs.values.size(), r.system->get().num_inputs());
            for (std::size_t k = 0; k < r.inputs.values.size(); ++k) {
              values.row(static_cast<Eigen::Index>(k)) = r.inputs.values[k].transpose();
            }
            return py::make_tuple(py::array(py::cast(r.inputs.grid)), values);
          },
          "(t [K], U [K×m]) as it was asked for.")
      .def_readonly("repeats", &Run::repeats,
                    "False: it is a return to an event and ends behind it, where no request ends;\n"
                    "it has no derivative, cannot be pickled or compared.")
      .def_property_readonly(
          "options", [](const Run& r) { return ToDict(r.options); },
          "Those it was made with, by name.")
      .def_property_readonly(
          "final_state",
          [](const py::object& self) {
            return View(self.cast<Run&>().trajectory.FinalState(), self);
          },
          "x at its end [nq+d], a read-only view.")
      .def("x", &State, py::arg("t"),
           "x(t) [nq+d] for a number, [len(t) × nq+d] for an array of them [s].")
      .def("force", &Force, py::arg("t"),
           "λ(t) [n+l+r], zero off the contact mode; [len(t) × n+l+r] for an array [N].")
      .def("u", &Input, py::arg("t"), "The input at t [m], or [len(t) × m].")
      .def(
          "mode",
          [](const Run& r, double t) {
            CheckInside(r, t);
            const Trajectory& trajectory = r.trajectory;
            return ToNames(trajectory.arcs[static_cast<std::size_t>(trajectory.ArcAt(t))].mode,
                           r.description());
          },
          py::arg("t"), "Names of the contacts that hold at t; at an event those before it.")
      .def_property_readonly(
          "modes",
          [](const Run& r) { return ToNames(r.trajectory.ModeSequence(), r.description()); },
          "Names of the contacts that hold on each arc in turn.")
      .def_property_readonly("mode_words", &Words,
                             "The same as words, one letter a contact: o open, l in contact, and\n"
                             "with friction s sticks, + or - slips.")
      .def_property_readonly(
          "arcs",
          [](const std::shared_ptr<Run>& r) { return Parts<ArcOf>(r, r->trajectory.arcs.size()); },
          "Maximal intervals of motion in one contact mode.")
      .def_property_readonly(
          "events",
          [](const std::shared_ptr<Run>& r) {
            return Parts<EventOf>(r, r->trajectory.transitions.size());
          },
          "What happens between them; simultaneous events are one.")
      .def_property_readonly(
          "warnings", [](const Run& r) { return r.trajectory.warnings; },
          "The first of them, in the order of time.")
      .def_property_readonly(
          "num_warnings", [](const Run& r) { return r.trajectory.num_warnings; },
          "Of all, also of those that `warnings` leaves out.")
      .def_property_readonly(
          "margins", [](const Run& r) { return r.trajectory.margins; },
          "How close it came to an event that did not happen.")
      .def_property_readonly(
          "statistics", [](const Run& r) { return r.trajectory.statistics; },
          "How much work it took.")
      .def_property_readonly(
          "accumulation_time", [](const Run& r) { return r.trajectory.accumulation_time; },
          "Where impacts accumulate [s]; NaN without Zeno.")
      .def("samples", &Sampled, py::arg("count") = 200,
           "(t [k], x [k × nq+d]): both ends of every arc, and `count` times over the whole run.\n"
           "At an event there are two rows, before and after.")
      .def("csv", &Csv, py::arg("count") = 200,
           "The same as CSV text, with names and contact modes; 17 digits.")
      .def("__repr__", &RunRepr);
}

}  // namespace python
}  // namespace contact_flow
