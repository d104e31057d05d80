// SPDX-License-Identifier: BSD-3-Clause
// The derivative of an OnlineFlow since a mark.
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/manifold_projection.h"
#include "directions.h"
#include "online.h"
#include "pickles.h"

namespace contact_flow {
namespace python {
namespace {

/// Directions are rows, as in Derivative's call.
struct RollingTangents {
  double t_mark = 0;  // [s]
  double t = 0;       // [s]
  Matrix directions;  // [k × 2d+n]
  Matrix tangents;    // [k × 2d]
  Vector time;        // [2d]
  Status status;
};

/// In which directions a run may start from now.
StartDirections Admitted(const Online& o, OnlineFlow& flow, const Variables& variables) {
  const MechanicalSystem& system = o.system->get();
  Vector x = flow.State();
  ProjectContacts(system, flow.mode(), &x);
  ContactDynamics dynamics(system, flow.NextInput(), variables);
  const StartCone cone(&dynamics, x, flow.mode(), flow.now(), o.options.gap_tolerance,
                       o.options.speed_tolerance, o.options.impact_law);
  return StartDirections(system, x, flow.mode(), cone, variables);
}

void Mark(Online& o, const py::object& directions, const py::object& by,
          const py::kwargs& keywords) {
  BDerivativeOptions options = ToOptions(keywords, BDerivativeOptions());
  options.variables = ToVariables(by, o.description());
  const MechanicalSystem& system = o.system->get();
  std::vector<Vector> given;
  if (!directions.is_none()) {
    if (py::isinstance<py::str>(directions) || py::isinstance<py::dict>(directions)) {
      throw py::type_error("directions is one direction, expected a sequence of them");
    }
    for (const py::handle w : directions) {
      given.push_back(ToDirection(system, options.variables, w));
    }
    if (given.empty()) throw py::value_error("directions is empty");
  }
  Alone(o, [&](OnlineFlow& flow) {
    const StartDirections admitted = Admitted(o, flow, options.variables);
    Matrix columns = admitted.Projector();
    for (std::size_t k = 0; k < given.size(); ++k) {
      CheckAdmitted(admitted, given[k], "directions[" + std::to_string(k) + "]");
    }
    if (!given.empty()) {
      columns.resize(given.front().size(), static_cast<Eigen::Index>(given.size()));
      for (std::size_t k = 0; k < given.size(); ++k) {
        columns.col(static_cast<Eigen::Index>(k)) = given[k];
      }
    }
    o.rolling = std::make_unique<RollingDerivative>(&flow, columns, options, o.options);
    return 0;
  });
}

RollingTangents TangentsOf(Online& o) {
  return Alone(o, [&](OnlineFlow& flow) {
    if (!o.rolling) throw py::value_error("no instant is marked");
    RollingDerivative::Reading now = o.rolling->Read(&flow);
    return RollingTangents{o.rolling->mark(),
                           now.t,
                           o.rolling->directions().transpose(),
                           now.tangents.transpose(),
                           std::move(now.time),
                           std::move(now.status)};
  });
}

void Unmark(Online& o) {
  Alone(o, [&](OnlineFlow&) {
    o.Unmark();
    return 0;
  });
}

template <class Field>
auto ViewOf(Field RollingTangents::*field) {
  return
      [field](const py::object& self) { return View(self.cast<RollingTangents&>().*field, self); };
}

}  // namespace

void BindRolling(py::module_* module) {
  py::class_<RollingTangents>(*module, "RollingTangents",
                              "The derivative of an OnlineFlow from its mark to an instant, along\n"
                              "chosen directions: B(w) of its motion so far.")
      .def_readonly("t_mark", &RollingTangents::t_mark, "The mark [s].")
      .def_readonly("t", &RollingTangents::t, "[s]; earlier than now where the status is not ok.")
      .def_property_readonly("directions", ViewOf(&RollingTangents::directions),
                             "Perturbations at the mark, a row each [k × 2d+n].")
      .def_property_readonly("tangents", ViewOf(&RollingTangents::tangents),
                             "Those of the state at t, a row each [k × 2d].")
      .def_property_readonly("time", ViewOf(&RollingTangents::time),
                             "What a later instant adds [2d].")
      .def_readonly("status", &RollingTangents::status,
                    "False: what was passed has no derivative, and why.")
      .def(PickledFields(&RollingTangents::t_mark, &RollingTangents::t,
                         &RollingTangents::directions, &RollingTangents::tangents,
                         &RollingTangents::time, &RollingTangents::status))
      .def("__repr__", [](const RollingTangents& r) {
        return "<RollingTangents of " + std::to_string(r.directions.rows()) + " directions, " +
               Number(r.t_mark) + " to " + Number(r.t) +
               (r.status.ok() ? " s>" : " s: " + std::string(OutcomeName(r.status.outcome)) + ">");
      });
  py::class_<Online, std::shared_ptr<Online>>(module->attr("OnlineFlow"))
      .def("mark", &Mark, py::arg("directions") = py::none(),
           py::arg("by") = py::make_tuple("state"),
           "From now on `tangents` is the derivative since now, along a sequence of directions as\n"
           "of Derivative; None: along all, projected to those that keep the contacts. `by` and\n"
           "options as in Run.derivative. A mark before is forgotten.")
      .def("unmark", &Unmark,
           "Forgets the mark: the motion behind is not kept, nor\n"
           "differentiated.")
      .def_property_readonly("tangents", &TangentsOf,
                             "The RollingTangents from the mark to now. ValueError without one.");
}

}  // namespace python
}  // namespace contact_flow
