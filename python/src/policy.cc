// SPDX-License-Identifier: BSD-3-Clause
// Policies: a run that is followed by feedback, and the tracker that is told of touchdowns.
#include "contact_flow/trajectory_optimization/policy.h"

#include <cmath>
#include <limits>
#include <sstream>

#include "contact_flow/io/policy_file.h"
#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

using SharedPolicy = std::shared_ptr<TrackingPolicy>;

/// A tracker with the policy that it follows.
struct Tracker {
  std::shared_ptr<const TrackingPolicy> policy;
  std::unique_ptr<PolicyTracker> tracker;

  const PolicyNames& names() const { return policy->names; }
};

std::vector<std::string> NamesOfState(const PolicyNames& names) {
  std::vector<std::string> all = names.coordinates;
  for (const std::string& name : names.velocities) all.push_back("d/dt " + name);
  return all;
}

/// Diagonal weights by name over `usual`, or numbers, or none.
Vector ToWeightVector(const py::object& value, const char* field, const Vector& usual,
                      const std::vector<std::string>& names) {
  return value.is_none() ? usual : ToNamedVector(value, field, usual, names);
}

SharedPolicy MakeOf(const std::shared_ptr<Run>& run, const py::object& state,
                    const py::object& input, const py::object& terminal, double reach,
                    const py::object& lower, const py::object& upper, const py::kwargs& options) {
  run->CheckRepeats("it has no policy");
  if (!run->options.dense) throw py::value_error("the run was made with dense=False");
  const MechanicalSystem& system = run->system->get();
  const SystemDescription& d = run->description();
  const BDerivativeOptions o = ToOptions(options, BDerivativeOptions());
  const std::vector<std::string> tangents = TangentNames(d, Variables());
  TrackingWeights weights;
  weights.state = ToWeightVector(state, "state", Vector::Ones(2 * system.dof()), tangents);
  weights.input = ToWeightVector(input, "input", Vector::Ones(system.num_inputs()), d.inputs);
  weights.terminal = ToWeightVector(terminal, "terminal", weights.state, tangents);
  SharedPolicy policy;
  try {
    policy = std::make_shared<TrackingPolicy>(WithoutLock(
        [&] { return MakePolicy(system, run->trajectory, run->inputs, reach, weights, o); }));
  } catch (const NoPolicy& reason) {
    throw NoDerivative(std::string(OutcomeName(reason.status().outcome)) + ": " + reason.what());
  }
  const Vector none = Vector::Constant(system.num_inputs(), kUnbounded);
  if (!lower.is_none()) policy->lower = ToNamedVector(lower, "lower", -none, d.inputs);
  if (!upper.is_none()) policy->upper = ToNamedVector(upper, "upper", none, d.inputs);
  CheckPolicy(*policy);
  return policy;
}

std::string TextOf(const TrackingPolicy& policy) {
  std::ostringstream text;
  WritePolicy(policy, &text);
  return text.str();
}

SharedPolicy FromText(const std::string& text, const std::string& name) {
  return std::make_shared<TrackingPolicy>(WithoutLock([&] { return ReadPolicy(text, name); }));
}

py::tuple NamesOfContacts(ConstraintSet contacts, const PolicyNames& names) {
  return py::tuple(py::cast(contacts.Names(names.constraints)));
}

py::list Phases(const TrackingPolicy& policy) {
  py::list phases;
  for (const ReferencePhase& phase : policy.reference.phases()) {
    py::dict one;
    one["mode"] = NamesOfContacts(phase.mode, policy.names);
    one["t_begin"] = phase.t_begin;
    one["t_end"] = phase.t_end;
    one["x_begin"] = phase.x_begin;
    one["x_end"] = phase.x_end;
    one["activated"] = NamesOfContacts(phase.activated, policy.names);
    one["released"] = NamesOfContacts(phase.released, policy.names);
    phases.append(one);
  }
  return phases;
}

void CheckTime(double t) {
  if (!std::isfinite(t)) throw py::value_error("t is " + Number(t) + ", expected a number [s]");
}

int ToPhase(const TrackingPolicy& policy, const py::object& phase, double t) {
  if (phase.is_none()) return policy.reference.PhaseAt(t);
  const int index = phase.cast<int>(), count = static_cast<int>(policy.reference.phases().size());
  if (index < 0 || index >= count) {
    throw py::index_error("phase is " + std::to_string(index) + ", the policy has " +
                          std::to_string(count));
  }
  return index;
}

ConstraintSet ToContactSet(const py::handle& given, const PolicyNames& names) {
  SystemDescription d;
  d.constraints = names.constraints;
  return python::ToContacts(given, d);
}

void Observe(Tracker& t, double at, const py::object& activated, const py::object& released,
             const py::object& mode) {
  CheckTime(at);
  std::optional<ConstraintSet> told;
  if (!mode.is_none()) told = ToContactSet(mode, t.names());
  t.tracker->Observe(at, ToContactSet(activated, t.names()), ToContactSet(released, t.names()),
                     told);
}

Vector InputOf(Tracker& t, double at, const py::object& x) {
  CheckTime(at);
  const std::vector<std::string> names = NamesOfState(t.names());
  const Vector state = ToVector(x, "x", static_cast<Eigen::Index>(names.size()), &names);
  if (!state.allFinite()) throw py::value_error("x has a number that is not finite");
  return t.tracker->Input(at, state);
}

void BindTracker(py::module_* module) {
  py::class_<Tracker>(*module, "PolicyTracker",
                      "Follows a policy by what it is told of the motion; of one thread at a time.")
      .def("observe", &Observe, py::arg("t"), py::arg("activated") = py::tuple(),
           py::arg("released") = py::tuple(), py::arg("mode") = py::none(),
           "Contacts touch down, or let go, at t [s], by their names; of soft contacts, which an\n"
           "event has as `switched`, both as activated. Knots of references need not be told.\n"
           "`mode`: all that touch from then on, where it is known.")
      .def("input", &InputOf, py::arg("t"), py::arg("x"),
           "The input [m] at t for the state x [nq+d]: u(t) − K (x ⊟ x(t)), within its bounds.")
      .def_property_readonly(
          "phase", [](const Tracker& t) { return t.tracker->phase(); }, "Of the reference, from 0.")
      .def_property_readonly(
          "events",
          [](const Tracker& t) {
            py::list events;
            for (const TrackedEvent& e : t.tracker->events()) {
              events.append(py::make_tuple(KindName(e.kind), e.t, e.expected,
                                           NamesOfContacts(e.constraints, t.names())));
            }
            return events;
          },
          "(kind, t, expected [s], constraints) so far: 'on time', 'early', 'late', 'missed',\n"
          "'extra'.")
      .def("__repr__", [](const Tracker& t) {
        return "<PolicyTracker of " + t.names().model + ", phase " +
               std::to_string(t.tracker->phase()) + ">";
      });
}

}  // namespace

void BindPolicy(py::module_* module) {
  BindTracker(module);
  py::class_<TrackingPolicy, SharedPolicy>(
      *module, "Policy",
      "How a run is followed: u = u(t) − K (x ⊟ x(t)), K by instant and phase of the motion. A\n"
      "value that knows of no system; it pickles as its text.")
      .def_static("from_text", &FromText, py::arg("text"), py::arg("name") = "text",
                  "From YAML; ValueError with key, value and line for what is wrong in it.")
      .def_property_readonly("text", &TextOf, "As YAML, to the bit.")
      .def_property_readonly(
          "model", [](const TrackingPolicy& p) { return p.names.model; },
          "The name of the model whose run it follows.")
      .def_property_readonly(
          "state_names",
          [](const TrackingPolicy& p) { return py::tuple(py::cast(NamesOfState(p.names))); },
          "Names of x [nq+d].")
      .def_property_readonly(
          "inputs", [](const TrackingPolicy& p) { return py::tuple(py::cast(p.names.inputs)); },
          "Names of u [m].")
      .def_property_readonly(
          "t",
          [](const TrackingPolicy& p) {
            return Vector(Eigen::Map<const Vector>(
                p.reference.inputs().grid.data(),
                static_cast<Eigen::Index>(p.reference.inputs().grid.size())));
          },
          "Instants at which input and gain change [K].")
      .def_property_readonly(
          "gains", [](const TrackingPolicy& p) { return p.gains; }, "K of each interval [m × 2d].")
      .def_readonly("gain_phases", &TrackingPolicy::gain_phases, "Phase in which each begins [K].")
      .def_readonly("kinked", &TrackingPolicy::kinked,
                    "Intervals whose outcome is only piecewise linear: gains of one piece.")
      .def_property_readonly("phases", &Phases,
                             "Between events of contacts, as dicts with mode, t_begin, t_end, "
                             "x_begin, x_end, activated, released.")
      .def(
          "u",
          [](const TrackingPolicy& p, double t) {
            CheckTime(t);
            return Vector(p.reference.Input(t));
          },
          py::arg("t"), "The input of the reference at t [m].")
      .def(
          "x",
          [](const TrackingPolicy& p, double t, const py::object& phase) {
            CheckTime(t);
            return p.reference.State(ToPhase(p, phase, t), t);
          },
          py::arg("t"), py::arg("phase") = py::none(),
          "The reference at t [nq+d], of the phase at t or of another one, which goes on beyond\n"
          "its events.")
      .def(
          "tracker",
          [](const SharedPolicy& policy, bool extend, double on_time, double patience) {
            for (const auto& [field, seconds] :
                 {std::make_pair("on_time", on_time), std::make_pair("patience", patience)}) {
              if (seconds >= 0 && std::isfinite(seconds)) continue;
              throw py::value_error(std::string(field) + " is " + Number(seconds) +
                                    " s, expected a number ≥ 0");
            }
            TrackerOptions options;
            options.extend = extend;
            options.on_time = on_time;
            options.patience = patience;
            return Tracker{policy, std::make_unique<PolicyTracker>(*policy, options)};
          },
          py::arg("extend") = true, py::arg("on_time") = TrackerOptions().on_time,
          py::arg("patience") = TrackerOptions().patience,
          "A PolicyTracker at its begin. extend=False: errors are those to the reference of the\n"
          "time, which jumps; on_time, patience [s]: what is a late event, and what is missed.")
      .def(py::pickle([](const TrackingPolicy& p) { return py::make_tuple(TextOf(p)); },
                      [](const py::tuple& t) {
                        return FromText(t[0].cast<std::string>(), "a pickled policy");
                      }))
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; })
      .def("__repr__", [](const TrackingPolicy& p) {
        return "<Policy of " + p.names.model + ": " + std::to_string(p.gains.size()) + " gains, " +
               std::to_string(p.reference.phases().size()) + " phases>";
      });
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def(
          "policy", &MakeOf, py::arg("state") = py::none(), py::arg("input") = py::none(),
          py::arg("terminal") = py::none(), py::arg("reach") = 0.1, py::arg("lower") = py::none(),
          py::arg("upper") = py::none(),
          "A Policy that follows the run, by the linear regulator along the derivatives of its\n"
          "intervals: Σ h (δxᵀQδx + δuᵀRδu) + δx(T)ᵀQ_T δx(T), with diagonals `state` [2d],\n"
          "`input` [m] and `terminal` [2d], numbers or dicts by name, 1 where left out (terminal:\n"
          "state). reach: by which each phase goes on beyond its events [s]; lower, upper: of the\n"
          "inputs, by name of those named alone. NoDerivative where an interval has none.");
}

}  // namespace python
}  // namespace contact_flow
