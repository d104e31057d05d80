// SPDX-License-Identifier: BSD-3-Clause
// Which hypotheses hold: at a state, at the events of a run, over a region; and what nearly grazes.
#include "contact_flow/analysis/assumptions.h"

#include "contact_flow/analysis/force_jumps.h"
#include "contact_flow/analysis/near_grazing.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

struct Assumptions {
  AssumptionReport report;
  std::vector<std::string> names;

  py::tuple Named(ConstraintSet set) const { return py::tuple(py::cast(set.Names(names))); }
};

py::tuple AssumptionsState(const Assumptions& a) {
  const AssumptionReport& r = a.report;
  py::list couplings;
  for (const Coupling& c : r.couplings) {
    couplings.append(py::make_tuple(c.first, c.second, c.value));
  }
  return py::make_tuple(a.names, r.touching.words(), r.smooth, r.mass_condition, r.rank,
                        r.condition, r.qualified, couplings, static_cast<int>(r.contact_class));
}

Assumptions AssumptionsFrom(const py::tuple& t) {
  Assumptions a;
  a.names = t[0].cast<std::vector<std::string>>();
  AssumptionReport& r = a.report;
  r.touching = ConstraintSet::FromWords(t[1].cast<ConstraintSet::Words>());
  r.smooth = t[2].cast<bool>();
  r.mass_condition = t[3].cast<double>();
  r.rank = t[4].cast<int>();
  r.condition = t[5].cast<double>();
  r.qualified = t[6].cast<bool>();
  for (const auto& entry : t[7]) {
    const auto c = entry.cast<py::tuple>();
    Coupling coupling;
    coupling.first = c[0].cast<int>();
    coupling.second = c[1].cast<int>();
    coupling.value = c[2].cast<double>();
    r.couplings.push_back(coupling);
  }
  r.contact_class = static_cast<ContactClass>(t[8].cast<int>());
  return a;
}

Assumptions AtState(const System& s, const py::object& x, const py::object& u,
                    const py::object& touching) {
  const Vector state = ToState(s, x), input = ToInput(s, u);
  const ConstraintSet contacts = touching.is_none() ? InitialMode(s.get(), state, input)
                                                    : ToContacts(touching, s.description());
  return {WithoutLock([&] { return AssessAssumptions(s.get(), state, input, contacts); }),
          s.description().constraints};
}

std::vector<Assumptions> AtEvents(const Run& run) {
  std::vector<Assumptions> all;
  for (AssumptionReport& report :
       WithoutLock([&] { return AssessTransitions(run.system->get(), run.trajectory); })) {
    all.push_back({std::move(report), run.description().constraints});
  }
  return all;
}

py::dict OverRegion(const System& s, const py::object& half_width, const py::object& x,
                    const py::object& u, int samples, unsigned seed) {
  if (samples < 1) {
    throw py::value_error("samples is " + std::to_string(samples) + ", expected ≥ 1");
  }
  const Vector state = ToState(s, x), input = ToInput(s, u);
  const Vector width = ToVector(half_width, "half_width", 2 * s.get().dof());
  const RegionReport report =
      WithoutLock([&] { return AssessRegion(s.get(), state, input, width, samples, seed); });
  const auto& names = s.description().constraints;
  py::list pairs;
  for (const PairInRegion& pair : report.pairs) {
    py::dict entry;
    entry["first"] = names[static_cast<std::size_t>(pair.first)];
    entry["second"] = names[static_cast<std::size_t>(pair.second)];
    entry["met"] = pair.met;
    entry["smallest"] = pair.smallest;
    entry["largest"] = pair.largest;
    entry["worst"] = ContactClassName(pair.worst);
    pairs.append(entry);
  }
  py::dict answer;
  answer["samples"] = report.samples;
  answer["smooth"] = report.smooth;
  answer["largest_mass_condition"] = report.largest_mass_condition;
  answer["pairs"] = pairs;
  return answer;
}

/// Of each event, the forces of its resting contacts while its impacts come apart.
py::list ForceJumps(const Run& run, double tolerance) {
  if (!(tolerance >= 0)) {
    throw py::value_error("tolerance is " + Number(tolerance) + ", expected ≥ 0");
  }
  const Trajectory& motion = run.trajectory;
  const auto& names = run.description().constraints;
  py::list events;
  for (std::size_t k = 0; k < motion.transitions.size(); ++k) {
    const ForceJumpReport report = WithoutLock([&] {
      return AssessForceJumps(run.system->get(), motion.arcs[k].u, motion.transitions[k],
                              tolerance);
    });
    py::dict contacts;
    for (const ForceJump& jump : report.contacts) {
      py::list stages;
      for (const StageForce& stage : jump.stages) {
        stages.append(
            py::make_tuple(ToNames(stage.activated, run.description()), stage.force, stage.rate));
      }
      py::dict contact;
      contact["fate"] = ForceFateName(jump.fate);
      contact["stages"] = stages;
      contacts[py::str(names[static_cast<std::size_t>(jump.constraint)])] = contact;
    }
    py::dict event;
    event["t"] = motion.transitions[k].t;
    event["computed"] = report.computed;
    event["smooth"] = report.smooth();
    event["contacts"] = contacts;
    events.append(event);
  }
  return events;
}

std::vector<std::string> NearGrazing(const Run& run, double approach_speed, double release_rate,
                                     double gap, double force) {
  const GrazingThresholds thresholds = {approach_speed, release_rate, gap, force};
  std::vector<std::string> sentences;
  for (const GrazingEvent& event : WithoutLock(
           [&] { return FindNearGrazing(run.system->get(), run.trajectory, thresholds); })) {
    sentences.push_back(Describe(run.description(), event));
  }
  return sentences;
}

}  // namespace

void BindAssumptions(py::module_* module) {
  py::class_<Assumptions>(*module, "Assumptions",
                          "The assumptions of the paper at one state, for what touches there.")
      .def_property_readonly(
          "touching", [](const Assumptions& a) { return a.Named(a.report.touching); },
          "Names of the contacts that are taken to touch.")
      .def_property_readonly(
          "smooth", [](const Assumptions& a) { return a.report.smooth; },
          "Assumption 2 at the state.")
      .def_property_readonly(
          "mass_condition", [](const Assumptions& a) { return a.report.mass_condition; },
          "Condition number of M.")
      .def_property_readonly(
          "rank", [](const Assumptions& a) { return a.report.rank; },
          "Assumption 3: of Da M⁻¹ Daᵀ over what touches.")
      .def_property_readonly(
          "condition", [](const Assumptions& a) { return a.report.condition; },
          "Of the gradients, in the kinetic metric.")
      .def_property_readonly(
          "independent", [](const Assumptions& a) { return a.report.independent(); },
          "Whether the gradients of all that touches are independent.")
      .def_property_readonly(
          "qualified", [](const Assumptions& a) { return a.report.qualified; },
          "Whether some velocity opens all gaps.")
      .def_property_readonly(
          "contact_class",
          [](const Assumptions& a) { return ContactClassName(a.report.contact_class); },
          "'single', 'orthogonal', 'attracting', 'order dependent', …")
      .def_property_readonly(
          "couplings",
          [](const Assumptions& a) {
            py::dict couplings;
            for (const Coupling& c : a.report.couplings) {
              couplings[py::make_tuple(a.names[static_cast<std::size_t>(c.first)],
                                       a.names[static_cast<std::size_t>(c.second)])] = c.value;
            }
            return couplings;
          },
          "G_ij/√(G_ii G_jj) of each pair of names.")
      .def(py::pickle(&AssumptionsState, &AssumptionsFrom))
      .def("__repr__", [](const Assumptions& a) {
        return "<Assumptions at " + a.report.touching.ToString(a.names) + ": " +
               ContactClassName(a.report.contact_class) + ", rank " +
               std::to_string(a.report.rank) + ">";
      });

  py::class_<System, std::shared_ptr<System>>(module->attr("System"))
      .def("assumptions", &AtState, py::arg("x") = py::none(), py::arg("u") = py::none(),
           py::arg("touching") = py::none(),
           "The assumptions at a state, for the contacts named, or for those of its mode.")
      .def("assumptions_over", &OverRegion, py::arg("half_width"), py::arg("x") = py::none(),
           py::arg("u") = py::none(), py::arg("samples") = 200, py::arg("seed") = 1,
           "Over x ± half_width [2d], as a dict: samples, smooth, largest_mass_condition, and for\n"
           "each pair of contacts whether they meet and how they are coupled then.");
  const GrazingThresholds usual;
  py::class_<Run, std::shared_ptr<Run>>(module->attr("Run"))
      .def("assumptions", &AtEvents, "The assumptions at each event, at (ρ, v⁻).")
      .def("force_jumps", &ForceJumps, py::arg("tolerance") = 1e-6,
           "What becomes of contacts that rest while simultaneous impacts, perturbed, come apart,\n"
           "as dicts, one an event: t [s], computed, smooth, and of each contact its fate,\n"
           "'keeps', 'released', 'regained' or 'near zero', and stages, (impacts so far, force "
           "[N],\n"
           "its rate [N/s]). Forces below `tolerance` of the largest count as zero.")
      .def("near_grazing", &NearGrazing, py::arg("approach_speed") = usual.approach_speed,
           py::arg("release_rate") = usual.release_rate, py::arg("gap") = usual.gap,
           py::arg("force") = usual.force,
           "Sentences about events that nearly graze, below these [m/s], [N/s], [m], [N].");
}

}  // namespace python
}  // namespace contact_flow
