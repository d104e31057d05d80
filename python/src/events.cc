// SPDX-License-Identifier: BSD-3-Clause
// Arcs and events of a run.
#include "contact_flow/flow/corner_functions.h"
#include "convert.h"
#include "run.h"

namespace contact_flow {
namespace python {
namespace {

/// What kinds of event meet here.
std::vector<std::string> Kinds(const Transition& e) {
  std::vector<std::string> kinds;
  if (!e.activated.Empty()) kinds.push_back("touchdown");
  if (!(e.released - e.switched).Empty()) kinds.push_back("release");
  if (!e.switched.Empty()) kinds.push_back("switch");
  if (!e.guards.empty() && e.mode_before != e.mode_after && e.activated.Empty()) {
    kinds.push_back("slip");
  }
  if (!e.grazed.Empty()) kinds.push_back("graze");
  if (e.completes_zeno) kinds.push_back("zeno");
  if (e.changes_input) kinds.push_back("input");
  return kinds;
}

/// All constraints that take part.
ConstraintSet Concerned(const Transition& e) {
  return e.activated | e.released | e.switched | e.vanishing | e.grazed | e.touching;
}

template <auto member>  // a ConstraintSet or ContactMode of a Transition
py::tuple NamesOf(const EventOf& e) {
  return ToNames(e.get().*member, e.description());
}

template <ContactMode Transition::*member>
std::string WordOf(const EventOf& e) {
  return (e.get().*member).Word(e.run->system->get().num_constraints());
}

template <Vector Transition::*member>
py::array VectorOf(const py::object& self) {
  return View(self.cast<const EventOf&>().get().*member, self);
}

std::string EventRepr(const EventOf& e) {
  const Transition& t = e.get();
  const auto& names = e.description().constraints;
  std::string text = "<Event at " + Number(t.t) + " s: " + Join(Kinds(t));
  const ConstraintSet all = Concerned(t);
  if (!all.Empty()) text += " of " + Join(all.Names(names));
  return text + ", " + t.mode_before.ToString(names) + " -> " + t.mode_after.ToString(names) + ">";
}

/// A part of a run pickles as the run and its number, and is a value.
template <class Part, class Class>
void MakeValue(Class* bound) {
  bound
      ->def(py::pickle(
          [](const Part& part) {
            return py::make_tuple(std::const_pointer_cast<Run>(part.run), part.index);
          },
          [](const py::tuple& state) {
            return Part{state[0].cast<std::shared_ptr<Run>>(), state[1].cast<std::size_t>()};
          }))
      .def("__copy__", [](const py::object& self) { return self; })
      .def("__deepcopy__", [](const py::object& self, const py::object&) { return self; });
}

void BindArc(py::module_* module) {
  py::class_<ArcOf> arc(*module, "Arc", "A maximal interval of motion in one contact mode.");
  MakeValue<ArcOf>(&arc);
  arc.def_property_readonly(
         "mode", [](const ArcOf& a) { return ToNames(a.get().mode, a.run->description()); },
         "Names of the contacts that hold.")
      .def_property_readonly(
          "word",
          [](const ArcOf& a) { return a.get().mode.Word(a.run->system->get().num_constraints()); },
          "The same as a word, one letter a contact.")
      .def_property_readonly(
          "t_begin", [](const ArcOf& a) { return a.get().t_begin; }, "[s]")
      .def_property_readonly(
          "t_end", [](const ArcOf& a) { return a.get().t_end; }, "[s]")
      .def_property_readonly(
          "u", [](const py::object& self) { return View(self.cast<ArcOf&>().get().u, self); },
          "Input [m].")
      .def_property_readonly(
          "x_begin",
          [](const py::object& self) { return View(self.cast<ArcOf&>().get().x_begin, self); },
          "Right limit at t_begin [nq+d].")
      .def_property_readonly(
          "x_end",
          [](const py::object& self) { return View(self.cast<ArcOf&>().get().x_end, self); },
          "Left limit at t_end [nq+d].")
      .def_property_readonly(
          "error",
          [](const py::object& self) { return View(self.cast<ArcOf&>().get().error, self); },
          "Estimated local errors of its steps, added up, as a tangent [2d].")
      .def_property_readonly(
          "limits",
          [](const ArcOf& a) {
            py::list passings;
            const MechanicalSystem& system = a.run->system->get();
            const auto* limits = dynamic_cast<const EffortLimits*>(&system);
            for (const LimitPassing& p : LimitPassings(system, a.get())) {
              const auto effort = static_cast<std::size_t>(p.effort);
              passings.append(py::make_tuple(p.t, limits->limited_efforts()[effort],
                                             EffortPieceName(p.before), EffortPieceName(p.after)));
            }
            return py::tuple(passings);
          },
          "Where efforts pass their limits inside it: (t [s], name, before, after), the last two\n"
          "'lower', 'free' or 'upper'. Of runs with dense=True.")
      .def("__repr__", [](const ArcOf& a) {
        return "<Arc " + Number(a.get().t_begin) + " to " + Number(a.get().t_end) + " s in " +
               a.get().mode.ToString(a.run->description().constraints) + ">";
      });
}

}  // namespace

void BindEvents(py::module_* module) {
  BindArc(module);
  py::class_<EventOf> event(
      *module, "Event",
      "What happens at one instant between two arcs: simultaneous events are one.\n"
      "Vectors are read-only views.");
  MakeValue<EventOf>(&event);
  event
      .def_property_readonly(
          "t", [](const EventOf& e) { return e.get().t; }, "[s]")
      .def_property_readonly(
          "kinds", [](const EventOf& e) { return py::tuple(py::cast(Kinds(e.get()))); },
          "Some of 'touchdown', 'release', 'switch', 'slip', 'graze', 'zeno', 'input'.")
      .def_property_readonly(
          "constraints",
          [](const EventOf& e) { return ToNames(Concerned(e.get()), e.description()); },
          "Names of all that take part.")
      .def_property_readonly("activated", &NamesOf<&Transition::activated>,
                             "Touched with a_i = 0, Da_i v⁻ < 0, whether it holds or bounces.")
      .def_property_readonly("released", &NamesOf<&Transition::released>,
                             "Held before, and no longer.")
      .def_property_readonly("vanishing", &NamesOf<&Transition::vanishing>,
                             "Held before, with a force that passes zero here.")
      .def_property_readonly("switched", &NamesOf<&Transition::switched>,
                             "Compliant ones whose gap passes zero.")
      .def_property_readonly("grazed", &NamesOf<&Transition::grazed>,
                             "Touched with vanishing speed: no derivative across it.")
      .def_property_readonly("touching", &NamesOf<&Transition::touching>,
                             "Touched without force, and hit or pressed from here on.")
      .def_property_readonly("mode_before", &NamesOf<&Transition::mode_before>, "J⁻")
      .def_property_readonly("mode_after", &NamesOf<&Transition::mode_after>, "J⁺")
      .def_property_readonly("word_before", &WordOf<&Transition::mode_before>,
                             "J⁻, a letter a contact.")
      .def_property_readonly("word_after", &WordOf<&Transition::mode_after>,
                             "J⁺, a letter a contact.")
      .def_property_readonly("x_minus", &VectorOf<&Transition::x_minus>, "(ρ, v⁻) [nq+d]")
      .def_property_readonly("x_plus", &VectorOf<&Transition::x_plus>, "(ρ, v⁺) [nq+d]")
      .def_property_readonly("impulse", &VectorOf<&Transition::impulse>,
                             "p, then those of bilateral constraints and tangential rows [N·s]; "
                             "zeros where no impact.")
      .def_property_readonly(
          "spread", [](const EventOf& e) { return e.get().spread; },
          "Time between its first and last event [s].")
      .def_property_readonly(
          "energy_lost", [](const EventOf& e) { return e.get().energy_lost; },
          "Kinetic energy that making small speeds rest takes [J]; below zero where "
          "forces give more during the bounces that it stands for.")
      .def_property_readonly(
          "obstacle", [](const EventOf& e) { return e.get().obstacle; },
          "Why there is no derivative across it, where there is none.")
      .def("__repr__", &EventRepr);
}

}  // namespace python
}  // namespace contact_flow
