// SPDX-License-Identifier: BSD-3-Clause
// Feedbacks once a step that stabilise an orbit, and the runs under them.
#include "contact_flow/analysis/step_feedback.h"
#include "contact_flow/piecewise_linear/stabilizing_feedback.h"
#include "convert.h"
#include "poincare.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

/// A feedback with the return map whose orbit it stabilises.
struct Feedback {
  std::shared_ptr<const Poincare> map;
  StepFeedback step;
  PiecewiseLinearMap controlled;
  StabilizingFeedback found;
  Question question;

  const System& system() const { return *map->system; }
};

Feedback FindFeedback(const std::shared_ptr<Poincare>& map, const py::object& x,
                      const std::vector<std::string>& translation, const py::object& inputs,
                      bool piecewise, double good_enough) {
  const System& system = *map->system;
  const std::vector<std::string>& names = system.description().inputs;
  Feedback feedback;
  feedback.map = map;
  StepFeedback& step = feedback.step;
  step.x = ToState(system, x);
  step.u = map->u;
  for (const std::string& name :
       inputs.is_none() ? names : inputs.cast<std::vector<std::string>>()) {
    step.inputs.push_back(IndexOf("input", name, names));
  }
  if (step.inputs.empty()) throw py::value_error("a feedback needs an input, the system has none");
  PoincareOptions options = map->options;
  options.derivative.variables = {};
  options.derivative.variables.inputs = true;
  const auto one = std::make_shared<PoincareReturn>(WithoutLock(
      [&] { return PoincareMap(system.get(), map->u, map->section, options).Return(step.x); },
      map->max_seconds));
  if (one->status != ReturnStatus::kReturned) {
    throw NoDerivative(std::string(ReturnStatusName(one->status)) + ": " + one->message);
  }
  const Matrix shift = OrbitShift({map->system,
                                   one,
                                   step.x,
                                   options.simulate,
                                   map->section.kind == Section::Kind::kEvent,
                                   {},
                                   map},
                                  translation);
  const ReducedMap controlled = ControlledReturn(system.get(), *one, shift, step.inputs);
  RequireSymmetry(controlled);
  step.basis = controlled.basis;
  feedback.controlled = controlled.map;
  FeedbackOptions settings;
  settings.piecewise = piecewise;
  settings.good_enough = good_enough;
  feedback.found = WithoutLock([&] { return FindStabilizingFeedback(controlled.map, settings); },
                               map->max_seconds);
  step.law = feedback.found.law;
  py::list set;
  for (int k : step.inputs) set.append(names[static_cast<std::size_t>(k)]);
  feedback.question =
      Question::Call(py::cast(map), "feedback", step.x, translation, set, piecewise, good_enough);
  return feedback;
}

void RequireLaw(const PiecewiseLinearMap& law) {
  if (law.pieces().empty()) throw py::value_error("there is no law");
}

FollowedOrbit FollowFrom(const Feedback& f, const py::object& x, int returns, double lost) {
  const Vector start = ToState(f.system(), x);
  if (returns < 0) {
    throw py::value_error("returns is " + std::to_string(returns) + ", expected ≥ 0");
  }
  RequireLaw(f.step.law);
  return WithoutLock(
      [&] {
        return Follow(f.system().get(), f.map->section, f.step, start, returns, f.map->options,
                      lost);
      },
      f.map->max_seconds);
}

/// Rows of equal length.
Matrix TableOf(const std::vector<Vector>& rows, Eigen::Index cols) {
  Matrix table(static_cast<Eigen::Index>(rows.size()), cols);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    table.row(static_cast<Eigen::Index>(k)) = rows[k].transpose();
  }
  return table;
}

void BindFollowed(py::module_* module) {
  py::class_<FollowedOrbit>(*module, "FollowedOrbit",
                            "Returns under a feedback: true where none failed.")
      .def("__bool__",
           [](const FollowedOrbit& f) {
             return f.status == ReturnStatus::kReturned || f.status == ReturnStatus::kNoDerivative;
           })
      .def_property_readonly(
          "x", [](const FollowedOrbit& f) { return TableOf(f.x, f.x.front().size()); },
          "At the section, the start first [k+1 × nq+d].")
      .def_property_readonly(
          "u", [](const FollowedOrbit& f) { return TableOf(f.u, f.u.empty() ? 0 : f.u[0].size()); },
          "From one to the next [k × m].")
      .def_readonly("away", &FollowedOrbit::away, "|z| of each x.")
      .def_property_readonly(
          "status", [](const FollowedOrbit& f) { return ReturnStatusName(f.status); },
          "Of the last return.")
      .def_readonly("message", &FollowedOrbit::message, "Why there is no further one.")
      .def(PickledFields(&FollowedOrbit::x, &FollowedOrbit::u, &FollowedOrbit::away,
                         &FollowedOrbit::status, &FollowedOrbit::message))
      .def("__repr__", [](const FollowedOrbit& f) {
        return "<FollowedOrbit of " + std::to_string(f.u.size()) + " returns, " +
               Number(f.away.back()) + " away>";
      });
}

}  // namespace

void BindFeedback(py::module_* module) {
  BindFollowed(module);
  py::class_<Feedback> feedback(
      *module, "Feedback",
      "Inputs that are set once a step and held: true where a certificate proves\n"
      "that they make the orbit exponentially stable.");
  PickleQuestion(&feedback);
  feedback.def("__bool__", [](const Feedback& f) { return f.found.certified; })
      .def_property_readonly(
          "certified", [](const Feedback& f) { return f.found.certified; },
          "Whether a certificate was found.")
      .def_property_readonly(
          "message", [](const Feedback& f) { return f.found.message; },
          "What proves it, or why nothing does.")
      .def_property_readonly(
          "rate", [](const Feedback& f) { return f.found.rate; },
          "Of the closed loop in the best common quadratic norm found.")
      .def_property_readonly(
          "law", [](const Feedback& f) { return f.found.law; },
          "z ↦ δu [m×n], z = basisᵀ (x ⊟ orbit).")
      .def_property_readonly(
          "step", [](const Feedback& f) { return f.controlled; },
          "(z, δu) ↦ z of the next return [n × n+m].")
      .def_property_readonly(
          "closed", [](const Feedback& f) { return f.found.closed; },
          "z ↦ z of the next return under the law [n×n].")
      .def_property_readonly(
          "certificate", [](const Feedback& f) { return f.found.certificate; }, "Of `closed`.")
      .def(
          "verify",
          [](const Feedback& f) {
            return f.found.certified && WithoutLock([&] {
                     return VerifyCertificate(f.found.closed, f.found.certificate);
                   });
          },
          "Whether the certificate proves stability, from its data and the map's alone.")
      .def_property_readonly(
          "basis",
          [](const py::object& self) { return View(self.cast<Feedback&>().step.basis, self); },
          "Orthonormal, of what is fed back [2d×n].")
      .def_property_readonly(
          "inputs",
          [](const Feedback& f) {
            py::list names;
            for (int k : f.step.inputs) names.append(f.system().description().inputs[k]);
            return py::tuple(names);
          },
          "Names of those that are set.")
      .def(
          "state",
          [](const Feedback& f, const py::object& z) {
            const Vector deviation = ToVector(z, "z", f.step.basis.cols());
            return f.system().get().Perturb(f.step.x, f.step.basis * deviation);
          },
          py::arg("z"), "The state at the section whose deviation from the orbit is z [n].")
      .def(
          "input",
          [](const Feedback& f, const py::object& x) {
            RequireLaw(f.step.law);
            return f.step.Input(f.system().get(), ToState(f.system(), x));
          },
          py::arg("x"), "The inputs to be held from the section at state x on [m].")
      .def("follow", &FollowFrom, py::arg("x"), py::arg("returns") = 50, py::arg("lost") = 1e3,
           "Simulates returns under the law from a state at the section, as a FollowedOrbit; ends\n"
           "where one fails or |z| exceeds `lost`.")
      .def("__repr__", [](const Feedback& f) { return "<Feedback " + f.found.message + ">"; });
  py::class_<Poincare, std::shared_ptr<Poincare>>(module->attr("PoincareMap"))
      .def("feedback", &FindFeedback, py::arg("x") = py::none(),
           py::arg("translation") = std::vector<std::string>{}, py::arg("inputs") = py::none(),
           py::arg("piecewise") = false, py::arg("good_enough") = 0.0,
           "Inputs as a law of the state at the section that make the orbit through x stable, as\n"
           "a Feedback: linear, or with a kink on each face of the return map. `inputs` names\n"
           "those that are set, all otherwise; `translation` as of PoincareReturn.stability.");
}

}  // namespace python
}  // namespace contact_flow
