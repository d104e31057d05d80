// SPDX-License-Identifier: BSD-3-Clause
// RecedingLoop: inputs that are chosen again and again as the motion goes on.
#include "receding.h"

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"
#include "contact_flow/trajectory_optimization/receding_tracker.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

/// The tracker may be asked while another thread solves.
struct Loop {
  std::shared_ptr<const System> system;
  HorizonProblem problem;
  HorizonOptions options;
  std::optional<RecedingTracker> tracker;
  mutable std::mutex mutex;

  const SystemDescription& description() const { return system->description(); }
};

template <class Work>
auto AloneWithLoop(const Loop& loop, Work&& work) {
  return WithoutLock([&] {
    const std::lock_guard<std::mutex> lock(loop.mutex);
    return work();
  });
}

/// Numbers, or one for all.
Vector Spread(const py::object& value, const char* field, Eigen::Index size, double standard) {
  if (value.is_none()) return Vector::Constant(size, standard);
  if (py::isinstance<py::float_>(value) || py::isinstance<py::int_>(value)) {
    return Vector::Constant(size, value.cast<double>());
  }
  return ToVector(value, field, size);
}

Vector Bound(const py::object& value, const char* field, Eigen::Index size) {
  return value.is_none() ? Vector() : Spread(value, field, size, 0);
}

std::shared_ptr<Loop> BeginLoop(
    const std::shared_ptr<System>& system, const py::object& x0, const py::object& inputs,
    const py::object& duration, const py::object& target, const py::object& weight,
    const py::object& effort, const py::object& path_weight, const py::object& path_target,
    const std::vector<std::tuple<std::string, std::string, double>>& power,
    const std::map<std::string, double>& impulse, const py::object& lower, const py::object& upper,
    int intervals, double budget, int max_iterations, bool search, const py::object& state_weights,
    const py::object& input_weights, const py::object& terminal_weights, double reach,
    double period) {
  auto loop = std::make_shared<Loop>();
  const MechanicalSystem& mechanics = system->get();
  const Eigen::Index m = mechanics.num_inputs(), nq = mechanics.num_positions();
  const Eigen::Index size = mechanics.state_size(), tangents = 2 * mechanics.dof();
  loop->system = system;
  TrajectoryProblem& whole = loop->problem.whole;
  whole.x = ToState(*system, x0);
  whole.inputs = ToSchedule(*system, inputs);
  whole.duration = ToDuration(*system, duration);
  whole.target = ToState(*system, target);
  whole.weight = Spread(weight, "weight", size, 1);
  whole.effort = Spread(effort, "effort", m, 1);
  whole.path_weight = Spread(path_weight, "path_weight", nq, 0);
  whole.path_target = Bound(path_target, "path_target", nq);
  whole.lower = Bound(lower, "lower", m);
  whole.upper = Bound(upper, "upper", m);
  const SystemDescription& names = mechanics.description();
  for (const auto& term : power) {
    whole.power.push_back({IndexOf("input", std::get<0>(term), names.inputs),
                           IndexOf("velocity", std::get<1>(term), names.velocities),
                           std::get<2>(term)});
  }
  if (!impulse.empty()) whole.impulse_weight = Vector::Zero(mechanics.num_constraints());
  for (const auto& [name, cost] : impulse) {
    whole.impulse_weight(IndexOf("constraint", name, names.constraints)) = cost;
  }
  loop->problem.intervals = intervals;
  HorizonOptions& options = loop->options;
  options.budget = budget;
  options.max_iterations = max_iterations;
  options.reach = reach;
  options.period = period;
  options.weights.state = Spread(state_weights, "state_weights", tangents, 1);
  options.weights.input = Spread(input_weights, "input_weights", m, 1);
  options.weights.terminal = terminal_weights.is_none()
                                 ? options.weights.state
                                 : Spread(terminal_weights, "terminal_weights", tangents, 1);
  WithoutLock([&] {
    if (search) whole.inputs = OptimizeTrajectory(mechanics, whole).inputs;
    loop->tracker.emplace(
        std::make_shared<const TrackingPolicy>(FirstPolicy(mechanics, loop->problem, options)));
    return 0;
  });
  return loop;
}

void ObserveLoop(Loop& loop, double t, const py::object& activated, const py::object& released,
                 const py::object& mode) {
  const SystemDescription& names = loop.description();
  const ConstraintSet down = ToContacts(activated, names), up = ToContacts(released, names);
  std::optional<ConstraintSet> now;
  if (!mode.is_none()) now = ToContacts(mode, names);
  AloneWithLoop(loop, [&] {
    loop.tracker->Observe(t, down, up, now);
    return 0;
  });
}

Vector LoopInput(Loop& loop, double t, const py::object& x) {
  const Vector state = ToState(*loop.system, x);
  return AloneWithLoop(loop, [&] { return loop.tracker->Input(t, state); });
}

HorizonSolution SolveNow(Loop& loop, double t, const py::object& x, const py::object& begin) {
  const Vector state = ToState(*loop.system, x);
  const double from = begin.is_none() ? t + loop.options.budget : begin.cast<double>();
  return WithoutLock([&] {
    const HorizonTask task = [&] {
      const std::lock_guard<std::mutex> lock(loop.mutex);
      return loop.tracker->Task(t, state, from);
    }();
    HorizonSolution solution = SolveHorizon(loop.system->system, loop.problem, loop.options, task);
    const std::lock_guard<std::mutex> lock(loop.mutex);
    loop.tracker->Offer(solution);
    return solution;
  });
}

py::list Reports(const Loop& loop) {
  const auto reports = AloneWithLoop(loop, [&] { return loop.tracker->reports(); });
  py::list list;
  for (const RecedingTracker::Report& report : reports) {
    list.append(py::make_tuple(report.solution, report.followed, report.message));
  }
  return list;
}

py::list Events(const Loop& loop) {
  const auto events = AloneWithLoop(loop, [&] { return loop.tracker->events(); });
  py::list list;
  for (const TrackedEvent& event : events) {
    list.append(py::make_tuple(KindName(event.kind), event.t, event.expected,
                               ToNames(event.constraints, loop.description())));
  }
  return list;
}

void BindSolution(py::module_* module) {
  py::class_<HorizonSolution>(*module, "HorizonSolution",
                              "What one solve of a RecedingLoop has found: true where there is a\n"
                              "policy to follow from `begin` on.")
      .def("__bool__", [](const HorizonSolution& s) { return s.policy != nullptr; })
      .def_property_readonly(
          "verdict", [](const HorizonSolution& s) { return VerdictName(s.verdict); },
          "'solved', 'unfinished' (its best is followed), 'late' or 'failed'.")
      .def_readonly("message", &HorizonSolution::message, "How it ended, as a sentence.")
      .def_readonly("t", &HorizonSolution::t, "Of the state that it knows [s].")
      .def_readonly("begin", &HorizonSolution::begin, "From when on it is to be followed [s].")
      .def_readonly("seconds", &HorizonSolution::seconds, "That it took, by the clock [s].")
      .def_readonly("iterations", &HorizonSolution::iterations, "Of its search.")
      .def_readonly("first_cost", &HorizonSolution::first_cost,
                    "Of the last solution, from where this one begins.")
      .def_readonly("cost", &HorizonSolution::cost, "Of this one.")
      .def(py::pickle(
          [](const HorizonSolution& s) {
            return py::make_tuple(static_cast<int>(s.verdict), s.message, s.t, s.begin, s.seconds,
                                  s.iterations, s.first_cost, s.cost,
                                  std::const_pointer_cast<TrackingPolicy>(s.policy));
          },
          [](const py::tuple& t) {
            HorizonSolution s;
            s.verdict = static_cast<decltype(s.verdict)>(t[0].cast<int>());
            s.message = t[1].cast<std::string>();
            s.t = t[2].cast<double>();
            s.begin = t[3].cast<double>();
            s.seconds = t[4].cast<double>();
            s.iterations = t[5].cast<int>();
            s.first_cost = t[6].cast<double>();
            s.cost = t[7].cast<double>();
            s.policy = t[8].cast<std::shared_ptr<TrackingPolicy>>();
            return s;
          }))
      .def("__repr__",
           [](const HorizonSolution& s) { return "<HorizonSolution " + s.message + ">"; });
}

}  // namespace

void BindReceding(py::module_* module) {
  BindSolution(module);
  py::class_<Loop, std::shared_ptr<Loop>>(
      *module, "RecedingLoop",
      "Follows a trajectory that is chosen again and again. `input` answers at once; `solve` may\n"
      "be called by a thread of its own.")
      .def("input", &LoopInput, py::arg("t"), py::arg("x"), "The input at t for the state x [m].")
      .def("observe", &ObserveLoop, py::arg("t"), py::arg("activated") = py::tuple(),
           py::arg("released") = py::tuple(), py::arg("mode") = py::none(),
           "Contacts touch down, or let go, at t; `mode` is what touches from then on.")
      .def("solve", &SolveNow, py::arg("t"), py::arg("x"), py::arg("begin") = py::none(),
           "Solves what is left from `begin` on (None: the budget behind t), knowing the state x\n"
           "at t, and offers what is found to be followed. Returns a HorizonSolution.")
      .def_property_readonly(
          "waits",
          [](const Loop& loop) {
            return AloneWithLoop(loop, [&] { return loop.tracker->Waits(); });
          },
          "Whether a solution waits for its begin: another one would take its place.")
      .def_property_readonly("reports", &Reports,
                             "(solution, followed, why not) of all solves that are decided.")
      .def_property_readonly("events", &Events,
                             "(kind, t, expected, constraints) of events beside the reference.")
      .def_property_readonly(
          "inputs",
          [](const Loop& loop) {
            const InputSchedule inputs =
                AloneWithLoop(loop, [&] { return loop.tracker->policy().reference.inputs(); });
            py::array_t<double> u(
                {inputs.values.size(), static_cast<std::size_t>(inputs.values.front().size())});
            for (std::size_t k = 0; k < inputs.values.size(); ++k) {
              for (Eigen::Index j = 0; j < inputs.values[k].size(); ++j) {
                u.mutable_at(k, static_cast<std::size_t>(j)) = inputs.values[k](j);
              }
            }
            return py::make_tuple(py::array_t<double>(static_cast<py::ssize_t>(inputs.grid.size()),
                                                      inputs.grid.data()),
                                  u);
          },
          "(t [K], u [K×m]) that are followed now.")
      .def("__repr__",
           [](const Loop& loop) { return "<RecedingLoop of " + loop.description().name + ">"; });
  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("receding_horizon", &BeginLoop, py::arg("x0") = py::none(),
           py::arg("inputs") = py::none(), py::arg("duration") = py::none(), py::kw_only(),
           py::arg("target") = py::none(), py::arg("weight") = py::none(),
           py::arg("effort") = py::none(), py::arg("path_weight") = py::none(),
           py::arg("path_target") = py::none(),
           py::arg("power") = std::vector<std::tuple<std::string, std::string, double>>{},
           py::arg("impulse") = std::map<std::string, double>{}, py::arg("lower") = py::none(),
           py::arg("upper") = py::none(), py::arg("intervals") = 0, py::arg("budget") = 0.05,
           py::arg("max_iterations") = 20, py::arg("search") = true,
           py::arg("state_weights") = py::none(), py::arg("input_weights") = py::none(),
           py::arg("terminal_weights") = py::none(), py::arg("reach") = 0.1,
           py::arg("period") = 1e-3,
           "A RecedingLoop that chooses the inputs of a Grid, to be least in\n"
           "  Σ h effort u² + Σ h path_weight (q − path_target)² + weight (x(T) − target)²\n"
           "  + ∫ w (u v)² dt for each (input u, velocity v, w) of `power`\n"
           "  + Σ w p² over touchdowns, for contacts and weights w of `impulse`,\n"
           "over `intervals` of the grid at a time (0: all that are left). Each solve takes\n"
           "`budget` seconds by the clock at most; between two of them a feedback with these\n"
           "weights follows. The first inputs are searched for, unless `search` is false.");
}

}  // namespace python
}  // namespace contact_flow
