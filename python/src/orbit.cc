// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits: fixed points of return maps, with free parameters and conditions.
#include "contact_flow/analysis/periodic_orbit.h"
#include "convert.h"
#include "poincare.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

struct Orbit {
  std::shared_ptr<System> system;  // with the parameters found
  std::shared_ptr<OrbitSolution> solution;
  SimulateOptions options;
  bool at_event = false;  // its section is one
  Question question;

  Return Closing(const py::object& self) const {
    // The return lives as long as the solution, whose own system its run refers to.
    return {system,      std::shared_ptr<const PoincareReturn>(solution, &solution->orbit),
            solution->x, options,
            at_event,    Question::Get(self, "closing")};
  }
};

/// {"kind": "touchdown", "name": "left_foot", "value": 0.2, "other": "right_foot"}
OrbitCondition ToCondition(const py::handle& given, const SystemDescription& d) {
  if (!py::isinstance<py::dict>(given)) throw py::type_error("a condition is a dict");
  const auto entry = py::reinterpret_borrow<py::dict>(given);
  for (const auto& item : entry) {
    IndexOf("field of a condition", py::str(item.first),
            {"kind", "name", "value", "other", "occurrence"});
  }
  static const std::vector<std::string> kinds = {"period", "coordinate", "velocity", "touchdown",
                                                 "lift_off"};
  const auto text = [&](const char* key) {
    if (!entry.contains(key)) throw py::value_error(std::string("a condition lacks '") + key + "'");
    return py::str(entry[key]).cast<std::string>();
  };
  OrbitCondition condition;
  condition.kind = static_cast<OrbitCondition::Kind>(IndexOf("condition", text("kind"), kinds));
  if (entry.contains("value")) condition.value = ToNumber(entry["value"], "value of a condition");
  if (entry.contains("occurrence")) {
    condition.occurrence = ToCount(entry["occurrence"], "occurrence of a condition");
  }
  switch (condition.kind) {
    case OrbitCondition::Kind::kPeriod:
      break;
    case OrbitCondition::Kind::kCoordinate:
      condition.index = IndexOf("coordinate", text("name"), d.coordinates);
      break;
    case OrbitCondition::Kind::kVelocity:
      condition.index = IndexOf("velocity", text("name"), d.velocities);
      break;
    default:
      condition.index = IndexOf("constraint", text("name"), d.constraints);
      if (entry.contains("other")) {
        condition.other = IndexOf("constraint", text("other"), d.constraints);
      }
  }
  return condition;
}

Orbit FixedPoint(const std::shared_ptr<Poincare>& shared, const py::object& x0,
                 const std::vector<std::string>& free, const py::iterable& asked, double tolerance,
                 int max_iterations) {
  const Poincare& map = *shared;
  const py::tuple conditions(OwnCopy(py::tuple(asked)));
  OrbitProblem problem;
  const System& system = *map.system;
  problem.factory = [&](const ParameterValues& values) { return system.Make(values); };
  problem.parameters = system.Values();
  problem.unknown_parameters = free;
  problem.section = map.section;
  problem.x = ToState(system, x0);
  problem.u = map.u;
  for (const auto& condition : conditions) {
    problem.conditions.push_back(ToCondition(condition, system.description()));
  }
  if (!(tolerance > 0)) {
    throw py::value_error("tolerance is " + Number(tolerance) + ", expected a number > 0");
  }
  if (max_iterations < 0) {
    throw py::value_error("max_iterations is " + std::to_string(max_iterations) + ", expected ≥ 0");
  }
  OrbitOptions options;
  options.poincare = map.options;
  options.newton.tolerance = tolerance;
  options.newton.max_iterations = max_iterations;
  auto solution = std::make_shared<OrbitSolution>(
      WithoutLock([&] { return FindOrbit(problem, options); }, map.max_seconds));
  return {system.With(solution->parameters), std::move(solution), map.options.simulate,
          map.section.kind == Section::Kind::kEvent,
          Question::Call(py::cast(shared), "fixed_point", problem.x, free, conditions, tolerance,
                         max_iterations)};
}

std::string OrbitRepr(const Orbit& o) {
  return "<Orbit of " + o.system->description().name + ": " +
         NewtonStatusName(o.solution->newton.status) + ", period " +
         Number(o.solution->orbit.time) + " s>";
}

}  // namespace

void BindOrbit(py::module_* module) {
  py::class_<Orbit> orbit(*module, "Orbit", "A periodic orbit, or how far the search came.");
  PickleQuestion(&orbit);
  orbit
      .def_property_readonly(
          "status", [](const Orbit& o) { return NewtonStatusName(o.solution->newton.status); },
          "'converged', 'stationary', 'stalled', 'undefined', …")
      .def_property_readonly(
          "message", [](const Orbit& o) { return o.solution->newton.message; },
          "Why the search ended, as a sentence.")
      .def("__bool__", [](const Orbit& o) { return o.solution->ok(); })
      .def_property_readonly(
          "x", [](const py::object& self) { return View(self.cast<Orbit&>().solution->x, self); },
          "Its state at the section [nq+d].")
      .def_property_readonly(
          "parameters", [](const Orbit& o) { return o.solution->parameters; },
          "All of them, by name.")
      .def_property_readonly(
          "system", [](const Orbit& o) { return o.system; }, "With these parameters.")
      .def_property_readonly(
          "period", [](const Orbit& o) { return o.solution->orbit.time; }, "[s]")
      .def_property_readonly(
          "residual", [](const Orbit& o) { return o.solution->newton.residual; },
          "(P(x) − x, conditions).")
      .def_property_readonly(
          "iterations",
          [](const Orbit& o) {
            py::list all;
            for (const NewtonIteration& i : o.solution->newton.iterations) {
              all.append(py::make_tuple(i.iteration, i.residual, i.step));
            }
            return all;
          },
          "(number, |residual|, length of the step) of each.")
      .def_property_readonly(
          "closing", [](const py::object& self) { return self.cast<const Orbit&>().Closing(self); },
          "One period, as a PoincareReturn, with DP where it exists.")
      .def(
          "stability",
          [](const py::object& self, const std::vector<std::string>& translation,
             const py::kwargs& options) {
            return StabilityOf(self.cast<const Orbit&>().Closing(self), translation, options);
          },
          py::arg("translation") = std::vector<std::string>{},
          "Of the orbit, with a certificate; see PoincareReturn.stability.")
      .def("__repr__", &OrbitRepr);
  py::class_<Poincare, std::shared_ptr<Poincare>>(module->attr("PoincareMap"))
      .def("fixed_point", &FixedPoint, py::arg("x0") = py::none(),
           py::arg("free") = std::vector<std::string>{}, py::arg("conditions") = py::tuple(),
           py::arg("tolerance") = NewtonOptions().tolerance,
           py::arg("max_iterations") = NewtonOptions().max_iterations,
           "A state with P(x) = x near x0, and values of the `free` parameters for which the\n"
           "conditions hold, as an Orbit. Conditions are dicts: {'kind': 'period', 'value': 0.8},\n"
           "{'kind': 'coordinate' or 'velocity', 'name': …, 'value': …}, {'kind': 'touchdown' or\n"
           "'lift_off', 'name': …, 'value': seconds after the section, or after that of 'other'}.");
}

}  // namespace python
}  // namespace contact_flow
