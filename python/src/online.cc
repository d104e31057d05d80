// SPDX-License-Identifier: BSD-3-Clause
// OnlineFlow: a run that goes along with a clock.
#include "online.h"

#include <cmath>
#include <optional>

namespace contact_flow {
namespace python {
namespace {

double Now(Online& online) {
  return Alone(online, [](OnlineFlow& flow) { return flow.now(); });
}

std::shared_ptr<Online> Begin(const std::shared_ptr<System>& system, const py::object& x0,
                              const py::object& u, double t, const py::kwargs& keywords) {
  auto online = std::make_shared<Online>();
  const SimulateOptions options = ToOptions(keywords, SimulateOptions());
  if (!std::isfinite(t)) throw py::value_error("t is " + Number(t) + ", expected a number [s]");
  online->system = system;
  online->options = options;
  online->flow = std::make_unique<OnlineFlow>(system->system, t, ToState(*system, x0),
                                              ToInput(*system, u), options);
  return online;
}

/// The transition that was passed, as an event of a run of its own.
py::object Passed(const Online& online, const Transition& t) {
  py::dict event;
  const SystemDescription& d = online.description();
  event["t"] = t.t;
  event["x_minus"] = t.x_minus;
  event["x_plus"] = t.x_plus;
  event["mode_before"] = ToNames(t.mode_before, d);
  event["mode_after"] = ToNames(t.mode_after, d);
  event["activated"] = ToNames(t.activated, d);
  event["released"] = ToNames(t.released, d);
  event["switched"] = ToNames(t.switched, d);
  event["impulse"] = t.impulse;
  return std::move(event);
}

py::object AdvanceTo(Online& online, double t) {
  const double now = Now(online);
  if (!std::isfinite(t)) throw py::value_error("t is " + Number(t) + ", expected a number [s]");
  if (t < now) {
    throw py::value_error("t is " + Number(t) + " s, before now, " + Number(now) + " s");
  }
  const auto passed = Alone(online, [&](OnlineFlow& flow) -> std::optional<Transition> {
    const bool passed = flow.AdvanceTo(t);
    online.Follow(passed);
    if (!passed) return std::nullopt;
    return flow.transition();
  });
  return passed ? Passed(online, *passed) : py::none();
}

}  // namespace

void BindOnline(py::module_* module) {
  py::class_<Online, std::shared_ptr<Online>>(
      *module, "OnlineFlow",
      "A run that goes along with a clock: asked for ever later instants, told inputs on the way.\n"
      "Its states are, to the bit, those of one simulate with the same inputs.")
      .def_property_readonly(
          "now", [](Online& o) { return Now(o); }, "[s]")
      .def_property_readonly(
          "status",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.status(); }); },
          "False: the run has ended at now.")
      .def_property_readonly(
          "mode",
          [](Online& o) {
            const auto mode = [](OnlineFlow& flow) { return flow.mode(); };
            return ToNames(Alone(o, mode), o.description());
          },
          "Names of the contacts that hold now.")
      .def_property_readonly(
          "x", [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.State(); }); },
          "The state now [nq+d].")
      .def_property_readonly(
          "u",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return Vector(flow.u()); }); },
          "The input that holds now [m].")
      .def_property_readonly(
          "warnings",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.warnings(); }); },
          "What the run went on from, in the order of time: the first of them.")
      .def_property_readonly(
          "num_warnings",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.num_warnings(); }); },
          "How many there were.")
      .def_property_readonly(
          "statistics",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.statistics(); }); },
          "How much work it took.")
      .def_property_readonly(
          "margins",
          [](Online& o) { return Alone(o, [](OnlineFlow& flow) { return flow.margins(); }); },
          "How close it came so far to an event that did not happen.")
      .def("advance_to", &AdvanceTo, py::arg("t"),
           "Goes on to t [s], or to the first event before or at t, which it returns as a dict\n"
           "with t, x_minus, x_plus, mode_before, mode_after, activated, released, switched (soft\n"
           "contacts, and knots of references), impulse; else None.")
      .def(
          "set_input",
          [](Online& o, const py::object& u, const py::object& t) {
            const Vector input = ToInput(*o.system, u);
            const double from = t.is_none() ? Now(o) : ToNumber(t, "t");
            Alone(o, [&](OnlineFlow& flow) {
              flow.SetInput(from, input);
              return 0;
            });
          },
          py::arg("u"), py::arg("t") = py::none(), "The input from t ≥ now on, until the next.")
      .def("__repr__", [](Online& o) {
        return "<OnlineFlow of " + o.description().name + " at " + Number(Now(o)) + " s>";
      });
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("online", &Begin, py::arg("x0") = py::none(), py::arg("u") = py::none(),
           py::arg("t") = 0.0, "An OnlineFlow from x0 at t [s]; options as in simulate.");
  BindRolling(module);
}

}  // namespace python
}  // namespace contact_flow
