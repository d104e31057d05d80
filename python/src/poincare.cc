// SPDX-License-Identifier: BSD-3-Clause
// Return maps: sections by name, the first return and its derivative.
#include "contact_flow/analysis/poincare.h"

#include <cmath>

#include "contact_flow/analysis/orbit_sizes.h"
#include "contact_flow/piecewise_linear/section.h"
#include "convert.h"
#include "poincare.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using SharedMap = std::shared_ptr<Poincare>;

SharedMap MakePoincare(const std::shared_ptr<System>& system, const py::object& section,
                       const py::object& u, const py::object& by, double horizon, double shortest,
                       double max_seconds_total, py::kwargs keywords) {
  CheckMaxSeconds(max_seconds_total, "max_seconds_total");
  auto map = std::make_shared<Poincare>();
  const py::kwargs given = py::dict(**keywords);
  const py::object variables = py::isinstance<py::str>(by) ? by : py::object(py::tuple(by));
  map->system = system;
  map->u = ToInput(*system, u);
  map->section = ToSection(*system, section);
  map->spec = section;
  const py::kwargs derivative = Take(DerivativeOptionNames(), &keywords);
  map->options.derivative = ToOptions(derivative, map->options.derivative);
  map->options.simulate = ToOptions(keywords, map->options.simulate);
  map->options.derivative.variables = ToVariables(variables, system->description());
  if (!(horizon > 0)) throw py::value_error("horizon is " + Number(horizon) + ", expected > 0");
  if (!(shortest >= 0) || !std::isfinite(shortest)) {
    throw py::value_error("shortest is " + Number(shortest) + " s, expected a number ≥ 0");
  }
  map->options.horizon = horizon;
  map->options.shortest = shortest;
  map->max_seconds = max_seconds_total;
  Validate(system->get(), map->section);
  map->question = Question::Call(py::cast(system), "poincare", section, map->u, variables, horizon,
                                 shortest, **given);
  return map;
}

Return Returns(const SharedMap& map, const py::object& x, bool differentiate) {
  const Vector start = ToState(*map->system, x);
  return {map->system,
          std::make_shared<PoincareReturn>(WithoutLock(
              [&] {
                return PoincareMap(map->system->get(), map->u, map->section, map->options)
                    .Return(start, differentiate);
              },
              map->max_seconds)),
          start,
          map->options.simulate,
          map->section.kind == Section::Kind::kEvent,
          Question::Call(py::cast(map), "__call__", start, differentiate),
          map};
}

/// The run to the return.
std::shared_ptr<Run> RunOf(const Return& r) {
  auto run = std::make_shared<Run>();
  run->system = r.system;
  run->trajectory = r.value->trajectory;
  if (run->trajectory.arcs.empty()) throw py::value_error("there is no run: " + r.value->message);
  run->x0 = r.start;
  run->inputs = InputSchedule::Constant(run->trajectory.arcs.front().u);
  run->duration = run->trajectory.t_end();
  run->options = r.options;
  run->options.dense = false;
  for (const Arc& arc : run->trajectory.arcs) {
    run->options.dense = run->options.dense || !arc.dense.Empty();
  }
  run->repeats = !(r.at_event && r.value->returned());
  return run;
}

template <PiecewiseLinearMap PoincareReturn::*member>
PiecewiseLinearMap MapOf(const Return& r) {
  if (r.value->status != ReturnStatus::kReturned || ((*r.value).*member).pieces().empty()) {
    throw NoDerivative(
        std::string(ReturnStatusName(r.value->status)) + ": " +
        (r.value->message.empty() ? "no derivative was asked for" : r.value->message));
  }
  return (*r.value).*member;
}

/// What is added to coordinates of a return, as pairs of name and number.
void ReadShifted(const System& system, const py::handle& spec, ReturnSymmetry* symmetry) {
  if (!py::hasattr(spec, "shifted")) return;
  for (const py::handle pair : spec.attr("shifted")) {
    const auto [name, given] = pair.cast<std::pair<std::string, py::object>>();
    const double amount = ToNumber(given, "shifted of a section");
    if (!std::isfinite(amount)) {
      throw py::value_error("shifted of a section is " + Number(amount) + " for '" + name +
                            "', expected a number that is finite");
    }
    symmetry->Shift(system.get(), name, amount);
  }
}

}  // namespace

Section ToSection(const System& system, const py::handle& spec) {
  for (const char* field : {"kind", "name", "value", "sign"}) {
    if (!py::hasattr(spec, field)) {
      throw py::type_error("section is " + py::repr(spec).cast<std::string>() +
                           ", expected Crossing, Apex, Touchdown or After");
    }
  }
  const SystemDescription& d = system.description();
  const auto kind = py::str(spec.attr("kind")).cast<std::string>();
  const auto name = py::str(spec.attr("name")).cast<std::string>();
  Section section;
  section.value = ToNumber(spec.attr("value"), "value of a section");
  const double sign = ToNumber(spec.attr("sign"), "sign of a section");
  if (!std::isfinite(section.value)) {
    throw py::value_error("value of a section is " + Number(section.value) +
                          ", expected a number that is finite");
  }
  if (sign != 0 && sign != 1 && sign != -1) {
    throw py::value_error("sign of a section is " + Number(sign) + ", expected -1, 0 or 1");
  }
  section.sign = static_cast<int>(sign);
  if (kind == "coordinate") {
    section.kind = Section::Kind::kCoordinate;
    section.index = IndexOf("coordinate", name, d.coordinates);
  } else if (kind == "velocity") {
    section.kind = Section::Kind::kVelocity;
    section.index = IndexOf("velocity", name, d.velocities);
  } else if (kind == "event") {
    section.kind = Section::Kind::kEvent;
    section.index = IndexOf("constraint", name, d.constraints);
  } else if (kind == "time") {
    section.kind = Section::Kind::kTime;
  } else {
    throw py::value_error("section.kind is '" + kind + "'");
  }
  ReadShifted(system, spec, &section.symmetry);
  return section;
}

constexpr double kSymmetry = 1e-6;  // a larger residual is no symmetry

Matrix OrbitShift(const Return& r, const std::vector<std::string>& translation) {
  const MechanicalSystem& system = r.system->get();
  const int d = system.dof();
  Matrix shift = Matrix::Zero(2 * d, translation.empty() ? 0 : 2);
  for (const std::string& name : translation) {
    const int i = IndexOf("coordinate", name, r.system->description().velocities);
    shift(i, 0) = shift(d + i, 1) = 1;
  }
  const double away = OffOrbit(system, r.start, *r.value, shift);
  if (!(away <= kOnOrbit)) {
    throw py::value_error("P(x) is " + Number(away) +
                          " times the size of the motion away from x: this is no orbit");
  }
  if (r.map == nullptr) return shift;
  const std::string differs = WithoutLock(
      [&] {
        const PoincareMap map(system, r.map->u, r.map->section, r.map->options);
        return NextReturnDiffers(system, map, r.start, *r.value, shift);
      },
      r.map->max_seconds);
  if (!differs.empty()) {
    throw py::value_error("translation is no symmetry of the motion: " + differs);
  }
  return shift;
}

void RequireSymmetry(const ReducedMap& rest) {
  if (rest.residual <= kSymmetry) return;
  throw py::value_error("translation is no symmetry of the return map: residual " +
                        Number(rest.residual));
}

py::object StabilityOf(const Return& r, const std::vector<std::string>& translation,
                       const py::kwargs& options) {
  const PiecewiseLinearMap reduced = MapOf<&PoincareReturn::reduced>(r);
  if (reduced.rows() != reduced.cols() || reduced.rows() == 0) {
    throw py::value_error(
        "directions along the section in the contact mode are not as many at the return as at the "
        "start: the derivative is no map of one space into itself");
  }
  const Matrix shift = OrbitShift(r, translation);
  if (translation.empty()) return py::cast(reduced).attr("stability")(**options);
  const Matrix seen = r.value->start_basis.transpose() * shift;
  ReducedMap rest = SetAside(reduced, seen);
  // A velocity that drag or a standing foot takes away is no symmetry: it stays.
  if (rest.residual > kSymmetry) rest = SetAside(reduced, seen.leftCols(1));
  RequireSymmetry(rest);
  return py::cast(rest.map).attr("stability")(**options);
}

void BindPoincare(py::module_* module) {
  py::class_<Poincare, SharedMap> map(
      *module, "PoincareMap", "The first return map P of a section, with its B-derivative.");
  PickleQuestion(&map);
  map.def_readonly("section", &Poincare::spec, "As it was given.")
      .def_property_readonly(
          "system", [](const Poincare& m) { return std::const_pointer_cast<System>(m.system); },
          "Whose returns they are.")
      .def("__call__", &Returns, py::arg("x") = py::none(), py::arg("derivative") = true,
           "One return from x (which need not lie on the section), as a PoincareReturn.")
      .def("__repr__", [](const Poincare& m) {
        return "<PoincareMap of " + m.system->description().name + " at " +
               py::repr(m.spec).cast<std::string>() + ">";
      });
  py::class_<Return> one(*module, "PoincareReturn",
                         "One return: true where the section was reached.");
  PickleQuestion(&one);
  one.def_property_readonly(
         "status", [](const Return& r) { return ReturnStatusName(r.value->status); },
         "'returned', 'no return', 'stopped', 'tangent', 'no derivative', …")
      .def_property_readonly(
          "message", [](const Return& r) { return r.value->message; }, "Why, as a sentence.")
      .def("__bool__", [](const Return& r) { return r.value->returned(); })
      .def_property_readonly(
          "time", [](const Return& r) { return r.value->time; }, "[s]")
      .def_property_readonly(
          "x", [](const py::object& self) { return View(self.cast<Return&>().value->x, self); },
          "P(x) [nq+d]")
      .def_property_readonly(
          "crossing_speed", [](const Return& r) { return r.value->crossing_speed; },
          "ds F there: the margin of transversality.")
      .def_property_readonly("run", &RunOf,
                             "The motion to the return, as a Run. Where the section is an event\n"
                             "it ends behind that: no request repeats it; no derivative.")
      .def_property_readonly("map", &MapOf<&PoincareReturn::map>,
                             "DP on all tangents [2d × 2d+k], a PiecewiseLinearMap; of those\n"
                             "that keep the contacts of the start the derivative, as `reduced`.")
      .def_property_readonly("reduced", &MapOf<&PoincareReturn::reduced>,
                             "DP in orthonormal bases of the admissible tangents of the section.")
      .def_property_readonly("return_time", &MapOf<&PoincareReturn::return_time>,
                             "Derivative of the time of return [1 × 2d+k].")
      .def_property_readonly(
          "start_basis",
          [](const py::object& self) {
            return View(self.cast<Return&>().value->start_basis, self);
          },
          "[2d×·]")
      .def_property_readonly(
          "end_basis",
          [](const py::object& self) { return View(self.cast<Return&>().value->end_basis, self); },
          "[2d×·]")
      .def("stability", &StabilityOf, py::arg("translation") = std::vector<std::string>{},
           "Of the orbit, where P(x) = x to 1e-6, as a Stability. `translation` names coordinates\n"
           "that may be shifted together, which is checked, and set aside, with their common\n"
           "velocity where that is kept, too. ValueError where P(x) is not x, or where the shift\n"
           "is no symmetry. Options: those of\n"
           "PiecewiseLinearMap.stability.")
      .def("__repr__", [](const Return& r) {
        return "<PoincareReturn after " + Number(r.value->time) +
               " s: " + ReturnStatusName(r.value->status) +
               (r.value->message.empty() ? ">" : ": " + r.value->message + ">");
      });
  const PoincareOptions usual;
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("poincare", &MakePoincare, py::arg("section"), py::arg("u") = py::none(),
           py::arg("by") = py::make_tuple("state"), py::arg("horizon") = usual.horizon,
           py::arg("shortest") = usual.shortest, py::arg("max_seconds_total") = kForever,
           "The first return map of a section: Crossing, Apex, Touchdown or After; `shifted` of\n"
           "it is added to coordinates of a return, as −T to the clock of a gait. `by` as in\n"
           "Run.derivative, `horizon` the longest return [s], crossings before `shortest` [s] are\n"
           "the start itself. Options of runs (tolerances of 1e-12 here) and of derivatives.\n"
           "An answer that takes longer than `max_seconds_total` ends, and says so.");
}

}  // namespace python
}  // namespace contact_flow
