// SPDX-License-Identifier: BSD-3-Clause
// Optimisation through contact: the least cost of an outcome.
#include "contact_flow/analysis/outcome_cost.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

struct Optimum {
  std::shared_ptr<const System> system;
  OutcomeProblem problem;  // with the unknowns at the best iterate
  std::vector<std::string> unknowns;
  DescentResult result;
  bool on_kink = false;
};

/// What it shows, and the system.
py::tuple ShownOptimum(const Optimum& o) {
  py::list iterations;
  for (const DescentIteration& i : o.result.iterations) {
    iterations.append(py::make_tuple(i.iteration, i.cost, i.step));
  }
  return py::make_tuple(std::const_pointer_cast<System>(o.system), o.unknowns, o.problem.x,
                        o.problem.u, static_cast<int>(o.result.status), o.result.message,
                        o.result.y, o.result.cost, o.result.steepest.slope, o.on_kink, iterations);
}

Optimum OptimumFrom(const py::tuple& t) {
  Optimum o;
  o.system = t[0].cast<std::shared_ptr<System>>();
  o.unknowns = t[1].cast<std::vector<std::string>>();
  o.problem.x = t[2].cast<Vector>();
  o.problem.u = t[3].cast<Vector>();
  o.result.status = static_cast<DescentStatus>(t[4].cast<int>());
  o.result.message = t[5].cast<std::string>();
  o.result.y = t[6].cast<Vector>();
  o.result.cost = t[7].cast<double>();
  o.result.steepest.slope = t[8].cast<double>();
  o.on_kink = t[9].cast<bool>();
  for (const auto& entry : t[10]) {
    const auto i = entry.cast<py::tuple>();
    DescentIteration iteration;
    iteration.iteration = i[0].cast<int>();
    iteration.cost = i[1].cast<double>();
    iteration.step = i[2].cast<double>();
    o.result.iterations.push_back(iteration);
  }
  return o;
}

OutcomeUnknown ToUnknown(const std::string& name, const SystemDescription& d) {
  std::vector<std::string> known = StateNames(d);
  known.insert(known.end(), d.inputs.begin(), d.inputs.end());
  int index = IndexOf("number to be chosen", name, known);
  const int nq = static_cast<int>(d.coordinates.size()), nv = static_cast<int>(d.velocities.size());
  using Kind = OutcomeUnknown::Kind;
  if (index < nq) return {Kind::kPosition, index};
  if (index < nq + nv) return {Kind::kVelocity, index - nq};
  return {Kind::kInput, index - nq - nv};
}

Optimum Optimize(const std::shared_ptr<System>& system, const std::vector<std::string>& unknowns,
                 const py::dict& target, const py::object& weight, const py::object& effort,
                 const py::object& x0, const py::object& duration, const py::object& u,
                 double tolerance, int max_iterations, double radius, py::kwargs keywords) {
  const SystemDescription& d = system->description();
  const std::vector<std::string> states = StateNames(d);
  Optimum optimum;
  optimum.system = system;
  optimum.unknowns = unknowns;
  OutcomeProblem& problem = optimum.problem;
  problem.x = ToState(*system, x0);
  problem.u = ToInput(*system, u);
  problem.duration = ToDuration(*system, duration);
  for (const std::string& name : unknowns) problem.unknowns.push_back(ToUnknown(name, d));
  const Vector zero = Vector::Zero(system->get().state_size());
  if (target.empty()) throw py::value_error("target is empty");
  problem.target = ToNamedVector(target, "target", zero, states);
  if (weight.is_none()) {  // 1 for what has a target
    problem.weight = zero;
    for (const auto& entry : target) {
      problem.weight(IndexOf("name", py::str(entry.first), states)) = 1;
    }
  } else {
    problem.weight = ToNamedVector(weight, "weight", zero, states);
    for (std::size_t k = 0; k < states.size(); ++k) {
      if (problem.weight(static_cast<Eigen::Index>(k)) != 0 && !target.contains(states[k])) {
        throw py::value_error("weight has '" + states[k] + "', which has no target");
      }
    }
  }
  const Vector none = Vector::Zero(system->get().num_inputs());
  for (const auto& [field, numbers] :
       {std::make_pair("target", &problem.target), std::make_pair("weight", &problem.weight)}) {
    if (numbers->allFinite()) continue;
    throw py::value_error(std::string(field) + " has a number that is not finite");
  }
  problem.effort = effort.is_none() ? none : ToNamedVector(effort, "effort", none, d.inputs);
  const py::kwargs derivative = Take(DerivativeOptionNames(), &keywords);
  problem.derivative = ToOptions(derivative, problem.derivative);
  problem.simulate = ToOptions(keywords, problem.simulate);
  DescentOptions options;
  options.tolerance = tolerance;
  options.max_iterations = max_iterations;
  options.radius = radius;
  const Vector start = UnknownValues(system->get(), problem);
  optimum.result = WithoutLock(
      [&] { return Minimize(MakeOutcomeCost(system->get(), problem), start, options); });
  problem = WithUnknowns(system->get(), problem, optimum.result.y);
  for (const Kink& kink : optimum.result.kinks) {
    optimum.on_kink = optimum.on_kink || kink.IsValley();
  }
  return optimum;
}

}  // namespace

void BindOptimize(py::module_* module) {
  py::class_<Optimum>(*module, "Optimum", "Where a descent ended.")
      .def_property_readonly(
          "status", [](const Optimum& o) { return DescentStatusName(o.result.status); },
          "'minimum', 'stalled', 'undefined', …")
      .def_property_readonly(
          "message", [](const Optimum& o) { return o.result.message; },
          "Why it ended, as a sentence.")
      .def("__bool__", [](const Optimum& o) { return o.result.status == DescentStatus::kMinimum; })
      .def_property_readonly(
          "cost", [](const Optimum& o) { return o.result.cost; }, "The least that was found.")
      .def_property_readonly(
          "y", [](const Optimum& o) { return o.result.y; },
          "Values of the unknowns, in their order.")
      .def_property_readonly(
          "values",
          [](const Optimum& o) {
            py::dict values;
            for (std::size_t k = 0; k < o.unknowns.size(); ++k) {
              values[py::str(o.unknowns[k])] = o.result.y(static_cast<Eigen::Index>(k));
            }
            return values;
          },
          "The same by name.")
      .def_property_readonly(
          "x0", [](const Optimum& o) { return o.problem.x; }, "[nq+d]")
      .def_property_readonly(
          "u", [](const Optimum& o) { return o.problem.u; }, "[m]")
      .def_property_readonly(
          "slope", [](const Optimum& o) { return o.result.steepest.slope; },
          "Of the steepest descent there: 0 at a minimum.")
      .def_readonly("on_kink", &Optimum::on_kink, "Whether the cost is kinked there.")
      .def(py::pickle(&ShownOptimum, &OptimumFrom))
      .def_property_readonly(
          "iterations",
          [](const Optimum& o) {
            py::list all;
            for (const DescentIteration& i : o.result.iterations) {
              all.append(py::make_tuple(i.iteration, i.cost, i.step));
            }
            return all;
          },
          "(number, cost, length of the step) of each.")
      .def("__repr__", [](const Optimum& o) {
        return "<Optimum " + std::string(DescentStatusName(o.result.status)) + ", cost " +
               Number(o.result.cost) + ">";
      });
  const DescentOptions usual;
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("optimize", &Optimize, py::arg("unknowns"), py::arg("target"),
           py::arg("weight") = py::none(), py::arg("effort") = py::none(),
           py::arg("x0") = py::none(), py::arg("duration") = py::none(), py::arg("u") = py::none(),
           py::arg("tolerance") = usual.tolerance, py::arg("max_iterations") = usual.max_iterations,
           py::arg("radius") = usual.radius,
           "Minimises ½ Σ w_i (x_i(T) − target_i)² + ½ Σ r_j u_j² over `unknowns`, names of\n"
           "numbers of the initial state or of inputs, as an Optimum. target: by name; weight w:\n"
           "by name, 1 for each target where it is left out; effort r: by input.");
}

}  // namespace python
}  // namespace contact_flow
