// SPDX-License-Identifier: BSD-3-Clause
// Run.gradient: what a run costs, and its gradient by all that it was given.

#include "contact_flow/derivative/cost_gradient.h"
#include "convert.h"
#include "directions.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

struct Gradient {
  std::shared_ptr<const Run> run;
  Variables variables;
  CostGradient value;
  Matrix inputs;  // [K×m]
  Question question;
};

/// Targets by name, and their weights: 1 for what has a target where they are left out.
void ToWeights(const py::dict& target, const py::object& weight, const char* field,
               const std::vector<std::string>& names, Vector* weights, Vector* targets) {
  const Vector zero = Vector::Zero(static_cast<Eigen::Index>(names.size()));
  *targets = ToNamedVector(target, field, zero, names);
  *weights = zero;
  if (!weight.is_none()) {
    *weights = ToNamedVector(weight, field, zero, names);
    return;
  }
  for (const auto& entry : target) {
    (*weights)(IndexOf(field, py::cast<std::string>(entry.first), names)) = 1;
  }
}

Gradient DifferentiateRunCost(const std::shared_ptr<Run>& run, const py::dict& target,
                              const py::object& weight, const py::dict& path_target,
                              const py::object& path_weight, const py::object& effort,
                              const py::object& effort_reference, const py::object& given_by,
                              const py::object& direction, const py::object& direction_inputs,
                              const py::object& direction_parameters, double max_seconds,
                              const py::kwargs& options) {
  CheckMaxSeconds(max_seconds);
  run->CheckRepeats("it has no gradient");
  if (!run->options.dense) throw py::value_error("the run was made with dense=False");
  const MechanicalSystem& system = run->system->get();
  const SystemDescription& names = run->description();
  BDerivativeOptions o = ToOptions(options, BDerivativeOptions());
  const py::object by =
      py::isinstance<py::str>(given_by) ? given_by : py::object(py::tuple(given_by));
  o.variables = ToVariables(by, names);
  QuadraticCost cost;
  const std::vector<std::string> states = StateNames(names);
  ToWeights(target, weight, "target", states, &cost.weight, &cost.target);
  ToWeights(path_target, path_weight, "path_target", states, &cost.state_weight,
            &cost.state_reference);
  const Vector none = Vector::Zero(system.num_inputs());
  if (!effort.is_none()) cost.input_weight = ToNamedVector(effort, "effort", none, names.inputs);
  if (!effort_reference.is_none()) {
    cost.input_reference = ToNamedVector(effort_reference, "effort_reference", none, names.inputs);
  }
  RunDirection w;
  if (!direction.is_none()) w.initial = ToVector(direction, "direction", 2 * system.dof());
  if (!direction_inputs.is_none()) {
    w.inputs = ToMatrix(direction_inputs, "direction_inputs", system.num_inputs()).transpose();
  }
  if (!direction_parameters.is_none()) {
    w.parameters = ToVector(direction_parameters, "direction_parameters",
                            static_cast<Eigen::Index>(o.variables.parameters.size()));
  }
  const bool along = w.initial.size() + w.inputs.size() + w.parameters.size() > 0;
  const RunCost made = cost.Make(system);
  const Arc& first = run->trajectory.arcs.front();
  const StartDirections starts(system, first.x_begin, first.mode, StartCone(), o.variables);
  CheckAdmitted(starts, w.AtStart(system, o.variables), "direction");
  Gradient gradient;
  gradient.run = run;
  gradient.variables = o.variables;
  gradient.value = WithoutLock(
      [&] { return DifferentiateCost(system, run->trajectory, made, o, along ? &w : nullptr); },
      max_seconds);
  gradient.value.KeepStart(system, o.variables, starts);
  gradient.inputs = gradient.value.inputs.transpose();
  gradient.question = Question::Call(
      py::cast(run), "gradient", OwnCopy(target), OwnCopy(weight), OwnCopy(path_target),
      OwnCopy(path_weight), OwnCopy(effort), OwnCopy(effort_reference), by, OwnCopy(direction),
      OwnCopy(direction_inputs), OwnCopy(direction_parameters), max_seconds, **options);
  return gradient;
}

}  // namespace

void BindGradient(py::module_* module) {
  const auto view = [](auto member) {
    return [member](const py::object& self) {
      return View(self.cast<Gradient&>().value.*member, self);
    };
  };
  py::class_<Gradient> gradient(*module, "CostGradient",
                                "The gradient of what a run costs; false where there is none.");
  PickleQuestion(&gradient);
  gradient
      .def_property_readonly(
          "status", [](const Gradient& g) { return g.value.status; },
          "False: there is no gradient, and why.")
      .def("__bool__", [](const Gradient& g) { return g.value.status.ok(); })
      .def_property_readonly(
          "cost", [](const Gradient& g) { return g.value.cost; }, "J")
      .def_property_readonly("initial", view(&CostGradient::initial),
                             "By (δq, δv) of the initial state [2d].")
      .def_property_readonly(
          "inputs",
          [](const py::object& self) { return View(self.cast<Gradient&>().inputs, self); },
          "By the input of each of the K intervals of the grid that the run meets [K×m].")
      .def_property_readonly("parameters", view(&CostGradient::parameters),
                             "By the parameters asked for.")
      .def_property_readonly("instants", view(&CostGradient::instants),
                             "By the instants when the input changes [K−1].")
      .def_property_readonly(
          "duration", [](const Gradient& g) { return g.value.horizon; },
          "By the duration; nan where\nthe input changes at its end.")
      .def_property_readonly(
          "whole", [](const Gradient& g) { return g.value.whole; },
          "False: the gradient of the direction's piece alone.")
      .def_property_readonly(
          "modes", [](const Gradient& g) { return ToNames(g.value.modes, g.run->description()); },
          "Contact modes that the run of this piece passes through, to first order.")
      .def_property_readonly(
          "law", [](const Gradient& g) { return g.value.law; },
          "Largest relative residual of λᵀF + l = constant.")
      .def("__repr__", [](const Gradient& g) {
        if (!g.value.status.ok()) {
          return "<CostGradient: " + std::string(OutcomeName(g.value.status.outcome)) + ">";
        }
        return "<CostGradient of " + Number(g.value.cost) +
               (g.value.whole ? ">" : ", one of several pieces>");
      });
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def("gradient", &DifferentiateRunCost, py::arg("target") = py::dict(),
           py::arg("weight") = py::none(), py::arg("path_target") = py::dict(),
           py::arg("path_weight") = py::none(), py::arg("effort") = py::none(),
           py::arg("effort_reference") = py::none(),
           py::arg("by") = py::make_tuple("state", "inputs"), py::arg("direction") = py::none(),
           py::arg("direction_inputs") = py::none(), py::arg("direction_parameters") = py::none(),
           py::arg("max_seconds") = kForever,
           "The gradient of ½ Σ w_i (x_i(T) − target_i)² + ½ ∫ Σ s_i (x_i − path_target_i)² +\n"
           "Σ r_j (u_j − effort_reference_j)² dt, as a CostGradient, by initial state, inputs of\n"
           "all intervals and the parameters in `by` at once. Targets by name; weights by name,\n"
           "1 for each target where they are left out; effort r by input. Where orders of events\n"
           "have different derivatives, the gradient is that of the piece of the direction\n"
           "(direction [2d], direction_inputs [K×m], direction_parameters).");
}

}  // namespace python
}  // namespace contact_flow
