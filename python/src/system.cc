// SPDX-License-Identifier: BSD-3-Clause
// System: names, units, parameters, the nominal run.
#include <sstream>

#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

/// A description lives as long as its system, which whoever holds it keeps.
template <class Member>
auto Of(Member SystemDescription::*member) {
  return
      [member](const System& system) { return py::tuple(py::cast(system.description().*member)); };
}

std::string SystemRepr(const System& system) {
  const SystemDescription& d = system.description();
  std::ostringstream text;
  text << "<" << system.Origin() << ": " << system.get().dof() << " velocities, "
       << d.constraints.size() << " contacts";
  if (!d.bilateral.empty()) text << ", " << d.bilateral.size() << " bilateral";
  if (!d.inputs.empty()) text << ", inputs " << Join(d.inputs);
  text << ", " << d.parameters.size() << " parameters>";
  return text.str();
}

std::string Describe(const System& system) {
  const SystemDescription& d = system.description();
  std::ostringstream text;
  text << d.name << ": " << d.summary << "\n\ncoordinates\n";
  for (std::size_t k = 0; k < d.coordinates.size(); ++k) {
    text << "  " << d.coordinates[k] << " [" << d.units[k] << "]\n";
  }
  if (d.velocities != d.coordinates) text << "velocities: " << Join(d.velocities) << "\n";
  text << "contacts: " << Join(d.constraints) << "\n";
  if (!d.bilateral.empty()) text << "bilateral: " << Join(d.bilateral) << "\n";
  if (!d.inputs.empty()) text << "inputs: " << Join(d.inputs) << "\n";
  text << "parameters\n";
  for (const Parameter& p : d.parameters) {
    text << "  " << p.name << " = " << Number(p.value) << " " << p.unit << ": " << p.meaning
         << "\n";
  }
  return text.str();
}

void BindDescription(py::module_* module) {
  py::class_<Parameter>(*module, "Parameter", "A named number of a system.")
      .def_readonly("name", &Parameter::name, "By which directions, states and requests call it.")
      .def_readonly("unit", &Parameter::unit, "SI unit, '' for a pure number.")
      .def_readonly("meaning", &Parameter::meaning, "One phrase.")
      .def_readonly("value", &Parameter::value, "In force.")
      .def(
          PickledFields(&Parameter::name, &Parameter::unit, &Parameter::meaning, &Parameter::value))
      .def("__repr__", [](const Parameter& p) {
        return "<Parameter " + p.name + " = " + Number(p.value) +
               (p.unit.empty() ? "" : " " + p.unit) + ": " + p.meaning + ">";
      });

  py::class_<NominalRun>(*module, "NominalRun", "The run of who asks for nothing in particular.")
      .def_property_readonly(
          "x", [](const py::object& self) { return View(self.cast<NominalRun&>().x, self); },
          "Initial state (q, v) [nq+d], a read-only view.")
      .def_property_readonly(
          "u", [](const py::object& self) { return View(self.cast<NominalRun&>().u, self); },
          "Constant input [m], a read-only view.")
      .def_readonly("duration", &NominalRun::duration, "[s]")
      .def(PickledFields(&NominalRun::x, &NominalRun::u, &NominalRun::duration))
      .def("__repr__",
           [](const NominalRun& run) { return "<NominalRun of " + Number(run.duration) + " s>"; });
}

}  // namespace

ParameterValues System::Values(const ParameterValues& changes) const {
  ParameterValues values;
  for (const Parameter& parameter : description().parameters) {
    values[parameter.name] = parameter.value;
  }
  for (const auto& [name, value] : changes) values[name] = value;
  return values;
}

void BindSystem(py::module_* module) {
  BindDescription(module);
  py::class_<System, std::shared_ptr<System>>(
      *module, "System",
      "A mechanical system subject to unilateral constraints, (M, f, a, γ). It is constant, and\n"
      "may be shared between threads. Made by Model, Robot or PythonModel.")
      .def_property_readonly(
          "name", [](const System& s) { return s.description().name; }, "Of the model.")
      .def_property_readonly(
          "summary", [](const System& s) { return s.description().summary; }, "One sentence.")
      .def_property_readonly("coordinates", Of(&SystemDescription::coordinates),
                             "Names of the numbers of a configuration q [nq].")
      .def_property_readonly("units", Of(&SystemDescription::units), "Of the coordinates [nq].")
      .def_property_readonly("velocities", Of(&SystemDescription::velocities),
                             "Names of the numbers of v, and of tangents [d].")
      .def_property_readonly("constraints", Of(&SystemDescription::constraints),
                             "Names of the unilateral constraints [n].")
      .def_property_readonly("bilateral", Of(&SystemDescription::bilateral),
                             "Names of the bilateral constraints [l].")
      .def_property_readonly("inputs", Of(&SystemDescription::inputs), "Names of the inputs [m].")
      .def_property_readonly(
          "state_names",
          [](const System& s) { return py::tuple(py::cast(StateNames(s.description()))); },
          "Names of the numbers of x = (q, v) [nq+d]; rates begin with 'd/dt '.")
      .def_property_readonly(
          "parameters",
          [](const System& s) {
            py::dict values;
            for (const Parameter& p : s.description().parameters) values[py::str(p.name)] = p.value;
            return values;
          },
          "Values in force, by name: a copy.")
      .def_property_readonly(
          "parameter_list", [](const System& s) { return s.description().parameters; },
          "Parameters with units and meanings.")
      .def_property_readonly(
          "nominal", [](const System& s) -> const NominalRun& { return s.get().nominal(); },
          py::return_value_policy::reference_internal,
          "The run of who asks for nothing in particular: x, u, duration.")
      .def_property_readonly(
          "dof", [](const System& s) { return s.get().dof(); }, "d, the number of velocities.")
      .def_property_readonly(
          "num_positions", [](const System& s) { return s.get().num_positions(); },
          "nq ≥ d, the numbers of a configuration.")
      .def_property_readonly(
          "state_size", [](const System& s) { return s.get().state_size(); }, "nq + d.")
      .def_property_readonly(
          "has_friction", [](const System& s) { return s.get().HasFriction(); },
          "Whether any contact has friction.")
      .def_property_readonly(
          "compliant",
          [](const System& s) { return ToNames(s.get().compliant(), s.description()); },
          "Names of the constraints that only switch the effort.")
      .def_property_readonly(
          "restitution", [](const System& s) { return Vector(s.get().restitution()); },
          "γ of each contact [n].")
      .def(
          "with_parameters",
          [](const System& s, const py::kwargs& values) {
            return s.With(s.Values(ToParameters(values)));
          },
          "A copy with other values of some parameters. ValueError for an unknown name, or a\n"
          "value out of its range.")
      .def(
          "state",
          [](const System& s, const py::kwargs& values) {
            return ToNamedVector(values, "state", s.get().nominal().x, StateNames(s.description()));
          },
          "The nominal state x [nq+d] with other values of some numbers, by name. Rates, whose\n"
          "names have a space: state(**{'d/dt body_z': -1}).")
      .def("describe", &Describe, "Names, units and parameters as text.")
      .def(
          "__copy__", [](const py::object& self) { return self; }, "Itself: it is constant.")
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def("__repr__", &SystemRepr);
}

}  // namespace python
}  // namespace contact_flow
