// SPDX-License-Identifier: BSD-3-Clause
// Trajectories through contact: what contact_flow/trajectories.py asks, and its answer as a dict.
#include <limits>
#include <optional>

#include "contact_flow/trajectory_optimization/multiple_shooting.h"
#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

constexpr double kNoBound = std::numeric_limits<double>::infinity();

/// A field of the question: numbers by name over `base`, or none.
Vector Named(const py::dict& asked, const char* field, const Vector& base,
             const std::vector<std::string>& names) {
  const py::object value = asked[field];
  if (value.is_none()) return Vector();
  return ToNamedVector(value, field, base, names);
}

Vector Numbers(const py::dict& asked, const char* field) {
  const py::object value = asked[field];
  return value.is_none() ? Vector() : ToVector(value, field, -1);
}

/// Targets by name, with their weights: 1 where these are left out.
void Goals(const py::dict& asked, const char* target_field, const char* weight_field,
           const std::vector<std::string>& names, Vector* target, Vector* weight) {
  const auto size = static_cast<Eigen::Index>(names.size());
  const py::object targets = asked[target_field];
  *target = ToNamedVector(targets, target_field, Vector::Zero(size), names);
  if (!asked[weight_field].is_none()) {
    *weight = Named(asked, weight_field, Vector::Zero(size), names);
    return;
  }
  *weight = Vector::Zero(size);
  if (!py::isinstance<py::dict>(targets)) weight->setOnes();
  for (Eigen::Index k = 0; k < size && py::isinstance<py::dict>(targets); ++k) {
    if (targets.contains(names[static_cast<std::size_t>(k)])) (*weight)(k) = 1;
  }
}

/// (kind, name, number, lower, upper)
TrajectoryCondition ToTrajectoryCondition(const py::handle& given, const SystemDescription& d) {
  const auto t = given.cast<py::tuple>();
  TrajectoryCondition condition;
  if (t[0].cast<std::string>() == "touchdown") {
    condition.kind = TrajectoryCondition::Kind::kTouchdown;
    condition.index = IndexOf("constraint", t[1].cast<std::string>(), d.constraints);
  } else {
    condition.index = IndexOf("number of the state", t[1].cast<std::string>(), StateNames(d));
  }
  condition.number = t[2].cast<int>();
  condition.lower = t[3].cast<double>();
  condition.upper = t[4].cast<double>();
  return condition;
}

void Choose(const System& system, const py::dict& asked, TrajectoryProblem* problem) {
  const SystemDescription& d = system.description();
  std::vector<std::string> parameters;
  for (const Parameter& parameter : d.parameters) parameters.push_back(parameter.name);
  problem->choose_inputs = asked["choose_inputs"].cast<bool>();
  for (const auto& name : asked["choose_initial"]) {
    problem->choose_initial.push_back(
        IndexOf("tangent", py::str(name), TangentNames(d, Variables())));
  }
  for (const auto& name : asked["choose_parameters"]) {
    problem->choose_parameters.push_back(IndexOf("parameter", py::str(name), parameters));
  }
  for (const auto& interval : asked["choose_durations"]) {
    problem->choose_durations.push_back(interval.cast<int>());
  }
  problem->keep_horizon = asked["keep_horizon"].cast<bool>();
  problem->factory = [&system](const ParameterValues& values) {
    return system.Make(system.Values(values));
  };
}

/// Weights by contact over zeros, or none.
Vector ByContact(const py::dict& asked, const char* field, const SystemDescription& d) {
  const auto given = asked[field].cast<py::dict>();
  if (given.empty()) return Vector();
  Vector weights = Vector::Zero(static_cast<Eigen::Index>(d.constraints.size()));
  for (const auto& [name, weight] : given) {
    weights(IndexOf("constraint", py::str(name), d.constraints)) = ToNumber(weight, field);
  }
  return weights;
}

void AddNamedCosts(const System& system, const py::dict& asked, TrajectoryProblem* problem) {
  const SystemDescription& d = system.description();
  for (const auto& given : asked["power"]) {
    const auto term = given.cast<py::tuple>();
    if (term.size() != 3) {
      throw py::value_error("power has a term of " + std::to_string(term.size()) +
                            " entries, expected (input, velocity, weight)");
    }
    problem->power.push_back({IndexOf("input", py::str(term[0]), d.inputs),
                              IndexOf("velocity", py::str(term[1]), d.velocities),
                              ToNumber(term[2], "power")});
  }
  problem->impulse_weight = ByContact(asked, "impulse", d);
  problem->slip_weight = ByContact(asked, "slip", d);
}

TrajectoryProblem ToProblem(const System& system, const py::dict& asked) {
  const SystemDescription& d = system.description();
  const Eigen::Index m = system.get().num_inputs(), nq = system.get().num_positions();
  TrajectoryProblem problem;
  problem.x = ToState(system, asked["x0"]);
  problem.inputs = ToSchedule(system, asked["inputs"]);
  problem.duration = ToDuration(system, asked["duration"]);
  Choose(system, asked, &problem);
  const Vector zero = Vector::Zero(m), unbounded = Vector::Constant(m, kNoBound);
  const Vector effort = Named(asked, "effort", zero, d.inputs);
  problem.effort = effort.size() == 0 ? zero : effort;
  problem.input_reference = Named(asked, "input_reference", zero, d.inputs);
  Goals(asked, "target", "weight", StateNames(d), &problem.target, &problem.weight);
  Goals(asked, "path_target", "path_weight", d.coordinates, &problem.path_target,
        &problem.path_weight);
  if (!asked["path_reference"].is_none()) {
    problem.path_reference = ToMatrix(asked["path_reference"], "path_reference", nq).transpose();
  }
  problem.duration_weight = asked["duration_weight"].cast<double>();
  AddNamedCosts(system, asked, &problem);
  problem.linear_inputs = asked["linear_inputs"].cast<bool>();
  problem.input_end = Named(asked, "input_end", problem.inputs.values.back(), d.inputs);
  for (const auto& condition : asked["conditions"]) {
    problem.conditions.push_back(ToTrajectoryCondition(condition, d));
  }
  problem.condition_tolerance = asked["condition_tolerance"].cast<double>();
  problem.lower = Named(asked, "lower", -unbounded, d.inputs);
  problem.upper = Named(asked, "upper", unbounded, d.inputs);
  problem.initial_lower = Numbers(asked, "initial_lower");
  problem.initial_upper = Numbers(asked, "initial_upper");
  problem.parameter_lower = Numbers(asked, "parameter_lower");
  problem.parameter_upper = Numbers(asked, "parameter_upper");
  problem.duration_lower = Numbers(asked, "duration_lower");
  problem.duration_upper = Numbers(asked, "duration_upper");
  problem.kink_interval = asked["kink_interval"].cast<double>();
  py::kwargs options = py::dict(asked["options"]);
  const py::kwargs derivative = Take(DerivativeOptionNames(), &options);
  problem.derivative = ToOptions(derivative, problem.derivative);
  problem.simulate = ToOptions(options, problem.simulate);
  return problem;
}

py::tuple ToTuple(const TrajectoryIteration& i) {
  return py::make_tuple(i.iteration, i.cost, i.best, i.violation, i.step, i.pieces,
                        KinkStatusName(i.kink));
}

py::dict ProofToDict(const PieceProof& proof) {
  py::list slopes;
  for (const KinkSlope& s : proof.slopes) {
    slopes.append(py::make_tuple(s.first, s.second, s.apart, s.slope));
  }
  py::dict piece;
  piece["label"] = proof.label;
  piece["slopes"] = slopes;
  piece["residual"] = proof.residual;
  piece["decrease"] = proof.decrease;
  piece["hull_weight"] = proof.hull_weight;
  return piece;
}

py::dict ToAnswer(const System& system, const TrajectoryProblem& problem,
                  const TrajectoryOptimum& found) {
  Matrix u(found.inputs.values.size(), system.get().num_inputs());
  for (std::size_t k = 0; k < found.inputs.values.size(); ++k) {
    u.row(static_cast<Eigen::Index>(k)) = found.inputs.values[k].transpose();
  }
  py::list iterations, certificate;
  for (const TrajectoryIteration& i : found.iterations) iterations.append(ToTuple(i));
  for (const PieceProof& proof : found.certificate) certificate.append(ProofToDict(proof));
  py::dict parameters;
  for (std::size_t k = 0; k < problem.choose_parameters.size(); ++k) {
    const auto index = static_cast<std::size_t>(problem.choose_parameters[k]);
    parameters[system.description().parameters[index].name.c_str()] =
        found.parameters(static_cast<Eigen::Index>(k));
  }
  py::dict answer;
  answer["verdict"] = VerdictName(found.verdict);
  answer["message"] = found.message;
  answer["cost"] = found.cost;
  answer["x0"] = found.x;
  answer["t"] = py::array(py::cast(found.inputs.grid));
  answer["u"] = u;
  answer["input_end"] = problem.linear_inputs ? py::cast(found.input_end) : py::none();
  answer["duration"] = found.duration;
  answer["parameters"] = parameters;
  answer["condition_values"] = found.condition_values;
  answer["multipliers"] = found.multipliers;
  answer["certificate"] = certificate;
  answer["hull_distance"] = found.hull_distance;
  answer["iterations"] = iterations;
  answer["valleys"] = found.valleys;
  answer["simulations"] = found.simulations;
  answer["derivatives"] = found.derivatives;
  answer["options"] = ToDict(problem.simulate);
  return answer;
}

py::dict OptimizeMotion(const std::shared_ptr<System>& system, const py::dict& asked,
                        const py::object& progress, double max_seconds) {
  CheckMaxSeconds(max_seconds);
  const TrajectoryProblem problem = ToProblem(*system, asked);
  TrajectoryOptions options;
  options.max_iterations = ToCount(asked["max_iterations"], "max_iterations", 0);
  options.tolerance = ToNumber(asked["tolerance"], "tolerance");
  options.neighbours = asked["neighbours"].cast<bool>();
  const bool by_shooting = asked["method"].cast<std::string>() == "multiple_shooting";
  ShootingOptions shooting;
  shooting.segments = asked["segments"].cast<std::vector<int>>();
  if (!asked["states"].is_none()) {
    shooting.states = ToMatrix(asked["states"], "states", system->get().state_size()).transpose();
  }
  std::optional<py::error_already_set> raised;
  if (!progress.is_none()) {
    options.progress = [&](const TrajectoryIteration& at, const Vector&) {
      const py::gil_scoped_acquire acquire;
      try {
        return !progress(*ToTuple(at)).is(py::bool_(false));
      } catch (py::error_already_set& error) {
        raised.emplace(std::move(error));
        return false;
      }
    };
  }
  const TrajectoryOptimum found = WithoutLock(
      [&] {
        return by_shooting ? OptimizeByShooting(system->get(), problem, options, shooting)
                           : OptimizeTrajectory(system->get(), problem, options);
      },
      max_seconds);
  if (raised) {
    py::error_already_set error = std::move(*raised);
    raised.reset();
    throw error;
  }
  return ToAnswer(*system, problem, found);
}

}  // namespace

void BindTrajectory(py::module_* module) {
  module->def("have_ipopt", &HaveIpopt, "Whether Ipopt is compiled in, for multiple shooting.");
  module->def("_optimize_trajectory", &OptimizeMotion, py::arg("system"), py::arg("asked"),
              py::arg("progress"), py::arg("max_seconds"));
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def(
          "optimize_trajectory",
          [](const py::object& system, const py::args& arguments, const py::kwargs& keywords) {
            return py::module_::import("contact_flow.trajectories")
                .attr("optimize_trajectory")(system, *arguments, **keywords);
          },
          "Inputs on a grid (and, if asked, start, parameters, instants) of least cost, through\n"
          "contact, as an OptimalTrajectory; the arguments are those of\n"
          "contact_flow.optimize_trajectory behind the system.");
}

}  // namespace python
}  // namespace contact_flow
