// SPDX-License-Identifier: BSD-3-Clause
// What derivatives answer with: trust, radii, quotients, event maps, linearized intervals.
#include <cmath>
#include <sstream>

#include "contact_flow/analysis/input_map.h"
#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/continued_outcomes.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/linearization.h"
#include "convert.h"
#include "pickles.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

struct Interval {
  std::shared_ptr<const Run> run;
  std::shared_ptr<IntervalLinearization> value;
};

/// What it shows, without the run and the derivative behind it.
py::tuple ShownOf(const Interval& i) {
  const IntervalLinearization& v = *i.value;
  return py::make_tuple(v.t_begin, v.t_end, v.x_begin, v.x_end, v.status, v.A, v.B, v.is_linear);
}

Interval FromShown(const py::tuple& t) {
  auto v = std::make_shared<IntervalLinearization>();
  v->t_begin = t[0].cast<double>();
  v->t_end = t[1].cast<double>();
  v->x_begin = t[2].cast<Vector>();
  v->x_end = t[3].cast<Vector>();
  v->status = t[4].cast<Status>();
  v->A = t[5].cast<Matrix>();
  v->B = t[6].cast<Matrix>();
  v->is_linear = t[7].cast<bool>();
  return {nullptr, std::move(v)};
}

py::list LinearizeRun(const std::shared_ptr<Run>& run, double max_seconds,
                      const py::kwargs& options) {
  CheckMaxSeconds(max_seconds);
  run->CheckRepeats("it has no derivative");
  const BDerivativeOptions o = ToOptions(options, BDerivativeOptions());
  if (!run->options.dense) throw py::value_error("the run was made with dense=False");
  std::vector<IntervalLinearization> all =
      WithoutLock([&] { return Linearize(run->system->get(), run->trajectory, o); }, max_seconds);
  py::list intervals;
  for (IntervalLinearization& one : all) {
    intervals.append(Interval{run, std::make_shared<IntervalLinearization>(std::move(one))});
  }
  return intervals;
}

PiecewiseLinearMap MapOfInputs(const std::shared_ptr<Run>& run, double max_seconds,
                               const py::kwargs& options) {
  CheckMaxSeconds(max_seconds);
  run->CheckRepeats("it has no derivative");
  const BDerivativeOptions o = ToOptions(options, BDerivativeOptions());
  if (!run->options.dense) throw py::value_error("the run was made with dense=False");
  return WithoutLock(
      [&] { return InputMap(Linearize(run->system->get(), run->trajectory, o), o.max_pieces); },
      max_seconds);
}

/// Where each order of the impacts leads, of the clusters whose order decides.
py::list Outcomes(const Derivative& d, bool continued) {
  const SystemDescription& names = d.run->description();
  py::list events;
  for (std::size_t k = 0; k < d.map.events.size(); ++k) {
    const EventMap& event = d.map.events[k];
    const std::vector<OrderOutcome>& outcomes = event.outcomes();
    if (outcomes.empty()) continue;
    std::vector<ContinuedOutcome> ends;
    if (continued) {
      ends = WithoutLock([&] {
        return ContinueOutcomes(d.system(), d.run->inputs, d.run->trajectory.transitions[k],
                                outcomes, d.run->inputs.grid.front() + d.run->duration,
                                d.run->options);
      });
    }
    for (std::size_t i = 0; i < outcomes.size(); ++i) {
      const OrderOutcome& outcome = outcomes[i];
      std::vector<std::string> order;
      for (int c : outcome.order) order.push_back(names.constraints[static_cast<std::size_t>(c)]);
      py::dict entry;
      entry["t"] = event.time();
      entry["order"] = py::tuple(py::cast(order));
      entry["v_plus"] = outcome.v_plus;
      entry["mode_after"] = ToNames(outcome.mode_after, names);
      entry["impulse"] = outcome.impulse;
      entry["status"] = outcome.status;
      if (continued) {
        entry["final_state"] = ends[i].final_state;
        entry["modes"] = ToNames(ends[i].modes, names);
        entry["final_status"] = ends[i].status;
      }
      events.append(entry);
    }
  }
  return events;
}

/// (time, class, activated) of each event map.
py::list EventClasses(const Derivative& d) {
  py::list events;
  for (const EventMap& event : d.map.events) {
    const ConstraintSet activated = event.ActivatedConstraints();
    events.append(py::make_tuple(event.time(), ContactClassName(event.cluster().contact_class),
                                 ToNames(activated, d.run->description()), event.status()));
  }
  return events;
}

std::string Table(const QuotientReport& report) {
  std::ostringstream text;
  text << "alpha      error\n";
  for (const QuotientSample& sample : report.samples) {
    text << sample.alpha << "  ";
    if (sample.status.ok()) {
      text << sample.error << "\n";
    } else {
      text << OutcomeName(sample.status.outcome) << "\n";
    }
  }
  text << "slope " << report.slope;
  return text.str();
}

void BindTrust(py::module_* module) {
  py::class_<Trust>(*module, "Trust",
                    "How far the numbers of a derivative can be trusted. A law is a residual\n"
                    "relative to its own terms; one that fails withholds the derivative.")
      .def_readonly("flow_law", &Trust::flow_law, "Φ F(x(t₀)) = F(x(t₁)) along the arcs.")
      .def_readonly("event_law", &Trust::event_law, "B_k(F⁻) = F⁺ at the transitions.")
      .def_readonly("face_law", &Trust::face_law, "Pieces agree on the face that they share.")
      .def_readonly("momentum", &Trust::momentum, "M (v⁺ − v⁻) = Daᵀ p + Dbᵀ r at impacts.")
      .def_readonly("energy", &Trust::energy, "Kinetic energy won at an impact, relative.")
      .def_readonly("condition", &Trust::condition, "Largest of what was inverted at events.")
      .def_property_readonly(
          "state_error",
          [](const py::object& self) { return View(self.cast<Trust&>().state_error, self); },
          "Estimated error of x(T) as a tangent [2d].")
      .def_readonly("derivative_error", &Trust::derivative_error,
                    "Estimated error of an entry, absolute.")
      .def_readonly("weakest_arc", &Trust::weakest_arc, "Whose errors weigh most; −1: none.")
      .def(PickledFields(&Trust::flow_law, &Trust::event_law, &Trust::face_law, &Trust::momentum,
                         &Trust::energy, &Trust::condition, &Trust::state_error,
                         &Trust::derivative_error, &Trust::weakest_arc))
      .def("__repr__", [](const Trust& t) {
        return "<Trust derivative_error " + Number(t.derivative_error) + ", flow_law " +
               Number(t.flow_law) + ", event_law " + Number(t.event_law) + ">";
      });
}

void BindRadius(py::module_* module) {
  const auto limit = [](const NamedRadius& r) {
    return std::string(std::isnan(r.value.radius) ? "unknown" : LimitName(r.value.limit));
  };
  py::class_<NamedRadius>(*module, "ValidityRadius",
                          "How far along a direction a derivative holds; float() is the radius.")
      .def_property_readonly(
          "radius", [](const NamedRadius& r) { return r.value.radius; },
          "α > 0, a factor on w; infinite: nothing that first order shows;\n"
          "NaN: not known.")
      .def_property_readonly("limit", limit,
                             "What changes there: 'event order', 'gap', …; 'none', or 'unknown'\n"
                             "where contacts have friction.")
      .def_property_readonly(
          "constraint",
          [](const NamedRadius& r) -> py::object {
            if (r.constraint.empty()) return py::none();
            return py::str(r.constraint);
          },
          "The name of that whose event it is; None: a whole event.")
      .def_property_readonly(
          "effort",
          [](const NamedRadius& r) -> py::object {
            if (r.value.effort.empty()) return py::none();
            return py::str(r.value.effort);
          },
          "The name of that which reaches its limit, or None.")
      .def_property_readonly(
          "t", [](const NamedRadius& r) { return r.value.t; }, "Of the unperturbed run [s].")
      .def("__float__", [](const NamedRadius& r) { return r.value.radius; })
      .def(py::pickle(
          [](const NamedRadius& r) {
            return py::make_tuple(r.value.radius, static_cast<int>(r.value.limit),
                                  r.value.constraint, r.value.t, r.constraint, r.value.effort);
          },
          [](const py::tuple& t) {
            NamedRadius r;
            r.value.radius = t[0].cast<double>();
            r.value.limit = static_cast<ValidityRadius::Limit>(t[1].cast<int>());
            r.value.constraint = t[2].cast<int>();
            r.value.t = t[3].cast<double>();
            r.constraint = t[4].cast<std::string>();
            r.value.effort = t[5].cast<std::string>();
            return r;
          }))
      .def("__repr__", [limit](const NamedRadius& r) {
        return "<ValidityRadius " + Number(r.value.radius) + ": " + limit(r) +
               (r.constraint.empty() ? ">" : " of " + r.constraint + ">");
      });
}

void BindQuotients(py::module_* module) {
  py::class_<QuotientSample>(*module, "QuotientSample", "One re-simulated, perturbed run.")
      .def_readonly("alpha", &QuotientSample::alpha, "Size of the perturbation.")
      .def_readonly("status", &QuotientSample::status, "False: no quotient.")
      .def_readonly("final_state", &QuotientSample::final_state,
                    "x(T) of the perturbed run [nq+d].")
      .def_readonly("quotient", &QuotientSample::quotient, "(x_α(T) − x_0(T)) / α [2d].")
      .def_readonly("error", &QuotientSample::error,
                    "max |quotient − B(w)|; NaN where there is no quotient.")
      .def(PickledFields(&QuotientSample::alpha, &QuotientSample::status,
                         &QuotientSample::final_state, &QuotientSample::quotient,
                         &QuotientSample::error))
      .def("__repr__", [](const QuotientSample& s) {
        return "<QuotientSample alpha " + Number(s.alpha) + ", error " + Number(s.error) + ">";
      });
  py::class_<QuotientReport>(*module, "QuotientReport",
                             "One-sided difference quotients beside a derivative.")
      .def_readonly("samples", &QuotientReport::samples, "In the order of the α given.")
      .def_readonly("slope", &QuotientReport::slope,
                    "Of log error over log α: 1 where the derivative is right; NaN where fewer\n"
                    "than two errors stand clear of rounding.")
      .def_readonly("resolution", &QuotientReport::resolution, "Of one final state, absolute.")
      .def_readonly("prediction_error", &QuotientReport::prediction_error, "Estimated, of B(w).")
      .def(PickledFields(&QuotientReport::samples, &QuotientReport::slope,
                         &QuotientReport::resolution, &QuotientReport::prediction_error))
      .def("__str__", &Table)
      .def("__repr__", [](const QuotientReport& r) {
        return "<QuotientReport of " + std::to_string(r.samples.size()) + " runs, slope " +
               Number(r.slope) + ">";
      });
}

void BindIntervals(py::module_* module) {
  py::class_<Interval>(*module, "Interval",
                       "One interval of an input grid to first order: δx⁺ = A δx + B δu, for δx\n"
                       "that keeps the contacts of its begin.")
      .def_property_readonly(
          "t_begin", [](const Interval& i) { return i.value->t_begin; }, "[s]")
      .def_property_readonly(
          "t_end", [](const Interval& i) { return i.value->t_end; }, "[s]")
      .def_property_readonly(
          "status", [](const Interval& i) { return i.value->status; },
          "False: no derivative, A and B are empty.")
      .def_property_readonly(
          "A", [](const py::object& self) { return View(self.cast<Interval&>().value->A, self); },
          "[2d×2d]")
      .def_property_readonly(
          "B", [](const py::object& self) { return View(self.cast<Interval&>().value->B, self); },
          "[2d×m]")
      .def_property_readonly(
          "x_begin",
          [](const py::object& self) { return View(self.cast<Interval&>().value->x_begin, self); },
          "The state at its begin [nq+d].")
      .def_property_readonly(
          "x_end",
          [](const py::object& self) { return View(self.cast<Interval&>().value->x_end, self); },
          "The state at its end [nq+d].")
      .def_property_readonly(
          "is_linear", [](const Interval& i) { return i.value->is_linear; },
          "False: [A B] is the selection of one order of events.")
      .def(py::pickle(&ShownOf, &FromShown))
      .def("__repr__", [](const Interval& i) {
        return "<Interval " + Number(i.value->t_begin) + " to " + Number(i.value->t_end) + " s: " +
               (i.value->status.ok() ? (i.value->is_linear ? "linear" : "one of several pieces")
                                     : OutcomeName(i.value->status.outcome)) +
               ">";
      });
}

}  // namespace

void BindDerivativeParts(py::module_* module) {
  BindTrust(module);
  BindRadius(module);
  BindQuotients(module);
  BindIntervals(module);
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def("linearize", &LinearizeRun, py::arg("max_seconds") = kForever,
           "(A_k, B_k) of each interval of the input grid, as Intervals. Raises BudgetExceeded\n"
           "where it takes longer than `max_seconds`.")
      .def("input_map", &MapOfInputs, py::arg("max_seconds") = kForever,
           "(δu_1, …, δu_K) ↦ δx(T) [2d × K m] of the inputs of the K intervals of the grid that\n"
           "the run meets, a PiecewiseLinearMap. `max_seconds` as for linearize.");
  py::class_<Derivative, std::shared_ptr<Derivative>>(module->attr("Derivative"))
      .def("outcomes", &Outcomes, py::arg("continued") = false,
           "Where the order of simultaneous impacts decides: what each order leads to, as dicts\n"
           "with t, order, v_plus, mode_after, impulse, status; `continued`: and where the run\n"
           "then ends.")
      .def_property_readonly("events", &EventClasses,
                             "(t, class of the cluster, constraints that meet, status) of each\n"
                             "event.");
}

}  // namespace python
}  // namespace contact_flow
