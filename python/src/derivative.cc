// SPDX-License-Identifier: BSD-3-Clause
// Run.derivative, and the derivative on directions: values, errors, modes, radii, quotients.
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "contact_flow/derivative/finite_difference.h"
#include "convert.h"
#include "directions.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Shared = std::shared_ptr<Derivative>;

Shared DifferentiateRun(const std::shared_ptr<const Run>& run, const BDerivativeOptions& o,
                        double max_seconds) {
  run->CheckRepeats("it has no derivative");
  auto derivative = std::make_shared<Derivative>();
  derivative->run = run;
  if (!run->options.dense) throw py::value_error("the run was made with dense=False");
  derivative->map = WithoutLock(
      [&] { return DifferentiateOutcome(run->system->get(), run->trajectory, o); }, max_seconds);
  derivative->directions =
      StartDirections(run->system->get(), run->trajectory.arcs.front().x_begin,
                      derivative->map.initial_mode, derivative->map.start, o.variables);
  return derivative;
}

Shared Differentiate(const std::shared_ptr<Run>& run, const py::object& by, double max_seconds,
                     const py::kwargs& options) {
  CheckMaxSeconds(max_seconds);
  BDerivativeOptions o = ToOptions(options, BDerivativeOptions());
  o.variables = ToVariables(by, run->description());
  return DifferentiateRun(run, o, max_seconds);
}

/// The run and the request.
py::tuple GetState(const Derivative& d) {
  const BDerivativeOptions& o = d.map.options;
  return py::make_tuple(std::const_pointer_cast<Run>(d.run), ToDict(o), o.variables.inputs,
                        o.variables.parameters);
}

Shared SetState(const py::tuple& state) {
  BDerivativeOptions o = ToOptions(py::kwargs(state[1]), BDerivativeOptions());
  o.variables.inputs = state[2].cast<bool>();
  o.variables.parameters = state[3].cast<std::vector<int>>();
  return DifferentiateRun(state[0].cast<std::shared_ptr<Run>>(), o, kForever);
}

std::vector<std::string> Tangents(const Derivative& d) {
  return TangentNames(d.run->description(), d.map.options.variables);
}

Eigen::Index Columns(const Derivative& d) {
  return 2 * d.system().dof() + d.map.options.variables.Size(d.system());
}

void CheckExists(const Derivative& d) {
  if (!d.map.status.ok()) {
    throw NoDerivative(std::string(OutcomeName(d.map.status.outcome)) + ": " +
                       d.map.status.message);
  }
}

Vector DirectionOf(const Derivative& d, const py::handle& w) {
  return ToDirection(d.system(), d.map.options.variables, w);
}

/// A direction in which a run may start.
Vector ToAdmitted(const Derivative& d, const py::handle& w) {
  const Vector direction = DirectionOf(d, w);
  CheckAdmitted(d.directions, direction, "w");
  return direction;
}

/// work() with the caches of the derivative to itself.
template <class Work>
auto AloneWith(const Derivative& d, Work&& work, double max_seconds = kForever) {
  return WithoutLock(
      [&] {
        const std::lock_guard<std::mutex> lock(d.mutex);
        return work();
      },
      max_seconds);
}

/// The same for what takes microseconds: no budget.
template <class Work>
auto Quickly(const Derivative& d, Work&& work) {
  const py::gil_scoped_release release;
  const std::lock_guard<std::mutex> lock(d.mutex);
  return work();
}

py::object Apply(const Derivative& d, const py::object& w, double dt) {
  CheckExists(d);
  if (!std::isfinite(dt)) throw py::value_error("dt is " + Number(dt) + ", expected a number [s]");
  if (py::isinstance<py::array>(w) && py::reinterpret_borrow<py::array>(w).ndim() == 2) {
    const Matrix directions = ToMatrix(w, "w", Columns(d));
    if (!directions.allFinite()) throw py::value_error("w has a number that is not finite");
    for (Eigen::Index k = 0; k < directions.rows(); ++k) {
      CheckAdmitted(d.directions, directions.row(k).transpose(), "w[" + std::to_string(k) + "]");
    }
    return py::cast(AloneWith(d, [&] {
      RowMajor values(directions.rows(), 2 * d.system().dof());
      for (Eigen::Index k = 0; k < directions.rows(); ++k) {
        values.row(k) = d.map(dt, directions.row(k).transpose()).transpose();
      }
      return values;
    }));
  }
  const Vector direction = ToAdmitted(d, w);
  return py::cast(Quickly(d, [&] { return dt == 0 ? d.map(direction) : d.map(dt, direction); }));
}

/// The pieces of w ↦ B(project(w)).
PiecewiseLinearMap Pieces(const Derivative& d, double max_seconds) {
  CheckExists(d);
  CheckMaxSeconds(max_seconds);
  return AloneWith(
      d,
      [&] {
        const PiecewiseLinearMap pieces = d.map.Pieces();
        if (d.directions.KeepsAll()) return pieces;
        const PiecewiseLinearMap kept = PiecewiseLinearMap::Linear(d.directions.Projector());
        return pieces.After(kept, d.map.options.max_pieces);
      },
      max_seconds);
}

bool IsDifferentiable(const Derivative& d) {
  return d.map.status.ok() && AloneWith(d, [&] { return d.map.IsDifferentiable(); });
}

Matrix Jacobian(const Derivative& d) {
  CheckExists(d);
  if (!IsDifferentiable(d)) {
    throw NoDerivative(
        "the outcome is not differentiable here, in the sense of one matrix: it has one-sided "
        "derivatives, B(w), and linear pieces where B.piecewise_linear is true");
  }
  return AloneWith(
      d, [&] { return Matrix(d.map.Pieces().pieces().front().matrix * d.directions.Projector()); });
}

py::tuple Clusters(const Derivative& d, const py::object& w) {
  CheckExists(d);
  const Vector direction = ToAdmitted(d, w);
  const ClusterReading reading = AloneWith(d, [&] { return ReadClusters(d.map, direction); });
  return py::make_tuple(reading.inner_radius, reading.in_order);
}

/// What is watched of the run serves all w.
NamedRadius Radius(const Derivative& d, const py::object& w, double max_seconds) {
  CheckExists(d);
  CheckMaxSeconds(max_seconds);
  const Vector direction = ToAdmitted(d, w);
  NamedRadius radius;
  radius.value = AloneWith(
      d,
      [&] {
        if (!d.estimator) {
          d.estimator = std::make_unique<ValidityEstimator>(d.system(), d.run->trajectory, d.map);
        }
        return (*d.estimator)(direction);
      },
      max_seconds);
  if (radius.value.constraint >= 0) {
    radius.constraint =
        d.run->description().constraints[static_cast<std::size_t>(radius.value.constraint)];
  }
  return radius;
}

py::list Modes(const Derivative& d, const py::object& w) {
  CheckExists(d);
  const Vector direction = ToAdmitted(d, w);
  return ToNames(Quickly(d, [&] { return d.map.PerturbedModes(direction); }), d.run->description());
}

/// The errors of B, by a second run, which serves all w.
std::shared_ptr<const MeasuredErrors> ErrorsOf(const Derivative& d) {
  if (d.errors) return d.errors;
  const Run& r = *d.run;
  auto errors = std::make_shared<const MeasuredErrors>(d.system(), r.x0, r.inputs, r.duration,
                                                       r.options, r.trajectory, d.map);
  const Outcome outcome = errors->status().outcome;
  const bool ended = outcome == Outcome::kBudgetExceeded || outcome == Outcome::kCancelled;
  if (!ended) d.errors = errors;
  return errors;
}

/// `max_seconds` are those of the second run.
Vector ErrorAlong(const Derivative& d, const py::object& w, double max_seconds) {
  CheckExists(d);
  CheckMaxSeconds(max_seconds);
  const Vector direction = ToAdmitted(d, w);
  const auto errors = AloneWith(
      d, [&] { return ErrorsOf(d); }, max_seconds);
  return AloneWith(d, [&] { return errors->Along(direction); });
}

QuotientReport Compare(const Derivative& d, const py::object& w,
                       const std::vector<double>& alphas) {
  CheckExists(d);
  for (double alpha : alphas) {
    if (alpha > 0 && std::isfinite(alpha)) continue;
    throw py::value_error("alphas has " + Number(alpha) + ", expected > 0");
  }
  const Vector direction = ToAdmitted(d, w);
  const Run& run = *d.run;
  const SystemFactory factory = [&](const ParameterValues& values) {
    return run.system->Make(values);
  };
  return AloneWith(d, [&] {
    return CompareWithQuotients(d.system(), factory, d.map.options.variables, run.x0, run.inputs,
                                run.duration, direction, d.map(direction), alphas, run.options,
                                ErrorsOf(d)->Along(direction).maxCoeff());
  });
}

Vector Project(const Derivative& d, const py::object& w) {
  const Vector direction = DirectionOf(d, w);
  return d.directions.Project(direction);
}

std::string Repr(const Derivative& d) {
  std::string text = "<Derivative of " + d.run->description().name + " [" +
                     std::to_string(2 * d.system().dof()) + "×" + std::to_string(Columns(d)) + "]";
  if (!d.map.status.ok()) {
    return text + ": " + OutcomeName(d.map.status.outcome) + ": " + d.map.status.message + ">";
  }
  return text + (IsDifferentiable(d) ? ": differentiable>" : ": one-sided>");
}

}  // namespace

void BindDerivative(py::module_* module) {
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def("derivative", &Differentiate, py::arg("by") = py::make_tuple("state"),
           py::arg("max_seconds") = kForever,
           "The B-derivative of the outcome, as a Derivative: by the initial state, and, where\n"
           "`by` names them, by 'inputs' (a shift of all of them), by parameters by their names,\n"
           "or by all 'parameters'. Tangents are (δq, δv, δu, δp) [2d+k]. Options: tolerance,\n"
           "kink_tolerance, max_activations_for_pieces, max_pieces. Where there is no derivative,\n"
           "or it takes longer than `max_seconds`, the status says why.");
  py::class_<Derivative, Shared>(
      *module, "Derivative",
      "The B-derivative of a run's outcome x(T): B(w) is the one-sided derivative along w.\n"
      "A direction w is an array (δq, δv, δu, δp) [2d+k] or (δq, δv) [2d], a dict of some numbers\n"
      "by name, or '+name', '-name'. Where there is none NoDerivative is raised.")
      .def_property_readonly(
          "status", [](const Derivative& d) { return d.map.status; },
          "False: there is no derivative, and why.")
      .def_property_readonly(
          "run", [](const Derivative& d) { return std::const_pointer_cast<Run>(d.run); },
          "The run whose outcome it is of.")
      .def_property_readonly(
          "tangents", [](const Derivative& d) { return py::tuple(py::cast(Tangents(d))); },
          "Names of the numbers of w [2d+k]; rates begin with 'd/dt '.")
      .def_property_readonly(
          "shape",
          [](const Derivative& d) { return py::make_tuple(2 * d.system().dof(), Columns(d)); },
          "(2d, 2d+k).")
      .def("direction", &DirectionOf, py::arg("w"), "w as an array [2d+k].")
      .def("__call__", &Apply, py::arg("w"), py::arg("dt") = 0,
           "B(w) [2d], with a change `dt` of the horizon [s]; of each row of an array [k × 2d+k]\n"
           "as [k × 2d]. ValueError for a direction in which no run may start: one that leaves\n"
           "the contacts of the start, project(w) keeps them, or leads through what it touches.")
      .def("jacobian", &Jacobian,
           "The matrix [2d × 2d+k] where the outcome is C¹: of w ↦ B(project(w)).")
      .def_property_readonly("is_differentiable", &IsDifferentiable,
                             "Whether it is C¹ on the directions that the start admits.")
      .def_property_readonly(
          "piecewise_linear",
          [](const Derivative& d) {
            return d.map.status.ok() ? AloneWith(d, [&] { return d.map.PiecewiseLinear(); })
                                     : d.map.status;
          },
          "A Status: whether it has linear pieces, or why not.")
      .def("pieces", &Pieces, py::arg("max_seconds") = kForever,
           "All of it, w ↦ B(project(w)), as a PiecewiseLinearMap. NotPiecewiseLinear where it is\n"
           "none, ValueError beyond max_pieces, BudgetExceeded where it takes longer than\n"
           "`max_seconds`.")
      .def("error", &ErrorAlong, py::arg("w"), py::arg("max_seconds") = kForever,
           "Error of B(w) [2d], absolute, measured by a second, finer run, which the first call\n"
           "makes; where that takes longer than `max_seconds`, estimated from the run itself.")
      .def("perturbed_modes", &Modes, py::arg("w"),
           "Names of the contacts that hold on each arc of the run perturbed along w.")
      .def("radius", &Radius, py::arg("w"), py::arg("max_seconds") = kForever,
           "How far along w it holds, as a ValidityRadius. Raises BudgetExceeded where it takes\n"
           "longer than `max_seconds`.")
      .def("clusters", &Clusters, py::arg("w"),
           "(α, B'(w)): below α the order of the merged events is that of their instants, with B'.")
      .def("compare", &Compare, py::arg("w"),
           py::arg("alphas") = std::vector<double>{1e-2, 1e-3, 1e-4, 1e-5, 1e-6},
           "One-sided difference quotients of perturbed runs beside B(w), as a QuotientReport.")
      .def("project", &Project, py::arg("w"),
           "w with the shortest change of (δq, δv) that keeps the contacts of the start; w itself\n"
           "for a start without contact.")
      .def_property_readonly(
          "time",
          [](const py::object& self) { return View(self.cast<Derivative&>().map.time, self); },
          "By the horizon: F(x(T)) [2d]; of shorter ones, where the input changes at T.")
      .def_property_readonly(
          "trust", [](const Derivative& d) { return d.map.trust; },
          "The laws it was held to, and the errors that are left.")
      .def_property_readonly(
          "neglected_jump",
          [](const py::object& self) {
            return View(self.cast<Derivative&>().map.neglected_jump, self);
          },
          "Jumps between orders of impacts that were neglected, at T [2d].")
      .def_property_readonly(
          "neglected_derivative", [](const Derivative& d) { return d.map.neglected_derivative; },
          "The same of an entry of the derivative: couplings taken for orthogonal.")
      .def(py::pickle(&GetState, &SetState))
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def("__repr__", &Repr);
}

}  // namespace python
}  // namespace contact_flow
