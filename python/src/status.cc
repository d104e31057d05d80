// SPDX-License-Identifier: BSD-3-Clause
// How things came out: Status and Warning, and the exceptions for misuse.
#include "contact_flow/flow/status.h"

#include <yaml-cpp/yaml.h>

#include "bindings.h"
#include "contact_flow/budget.h"
#include "contact_flow/derivative/event_map.h"
#include "pickles.h"

namespace contact_flow {
namespace python {

void BindStatus(py::module_* module) {
  py::class_<Status>(*module, "Status",
                     "How a run or a derivative came out: a value that is true where all is well.")
      .def_property_readonly(
          "outcome", [](const Status& s) { return OutcomeName(s.outcome); },
          "'ok', 'grazing', 'zeno', 'budget_exceeded', 'discontinuous', …")
      .def_readonly("message", &Status::message, "Why, as a sentence; empty where all is well.")
      .def_property_readonly("ok", &Status::ok, "Whether all is well.")
      .def("__bool__", &Status::ok)
      .def("__eq__",
           [](const Status& a, const py::object& b) {
             if (!py::isinstance<Status>(b)) return false;
             const Status& other = b.cast<const Status&>();
             return a.outcome == other.outcome && a.message == other.message;
           })
      .def("__hash__", [](const Status& s) { return static_cast<int>(s.outcome); })
      .def("__str__",
           [](const Status& s) {
             const std::string name = OutcomeName(s.outcome);
             return s.message.empty() ? name : name + ": " + s.message;
           })
      .def("__repr__",
           [](const Status& s) {
             const std::string name = OutcomeName(s.outcome);
             return "<Status " + name + (s.message.empty() ? ">" : ": " + s.message + ">");
           })
      .def(py::pickle(
          [](const Status& s) { return py::make_tuple(static_cast<int>(s.outcome), s.message); },
          [](const py::tuple& t) {
            return Status{static_cast<Outcome>(t[0].cast<int>()), t[1].cast<std::string>()};
          }));

  py::class_<Warning>(*module, "Warning", "Something on the way of a run that went on.")
      .def_property_readonly(
          "code", [](const Warning& w) { return OutcomeName(w.code); },
          "As Status.outcome: of what it passed.")
      .def_readonly("t", &Warning::t, "When [s].")
      .def_readonly("message", &Warning::message, "What happened, as a sentence.")
      .def(PickledFields(&Warning::code, &Warning::t, &Warning::message))
      .def("__repr__", [](const Warning& w) {
        return "<Warning " + std::string(OutcomeName(w.code)) + " at " + std::to_string(w.t) +
               " s: " + w.message + ">";
      });

  py::register_exception<BudgetExceeded>(*module, "BudgetExceeded", PyExc_RuntimeError);
  py::register_exception<NoDerivative>(*module, "NoDerivative", PyExc_ValueError);
  py::register_exception<NotPiecewiseLinear>(*module, "NotPiecewiseLinear", PyExc_ValueError);
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const YAML::Exception& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    }
  });
}

}  // namespace python
}  // namespace contact_flow
