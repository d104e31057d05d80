// SPDX-License-Identifier: BSD-3-Clause
// What a system is made of, at one state: M, f, a, the dynamics in a contact mode, impacts.
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/simulate.h"
#include "convert.h"
#include "unlocked.h"

namespace contact_flow {
namespace python {
namespace {

/// The vector, whose numbers must be finite: an impact at NaN would be none.
Vector Finite(Vector vector, const char* field) {
  if (vector.allFinite()) return vector;
  throw py::value_error(std::string(field) + " has a number that is not finite");
}

Vector Positions(const System& s, const py::handle& q) {
  return Finite(ToVector(q, "q", s.get().num_positions(), &s.description().coordinates), "q");
}

Vector Velocities(const System& s, const py::handle& v) {
  return Finite(ToVector(v, "v", s.get().dof(), &s.description().velocities), "v");
}

ConstraintTerms Constraints(const System& s, const Vector& q, const Vector& v) {
  ConstraintTerms terms;
  s.get().Constraints(q, v, &terms);
  return terms;
}

/// The contact mode of a word, one letter a contact. Throws ValueError for a letter that the
/// contact has not, or that the velocity at x contradicts.
ContactMode ToWord(const MechanicalSystem& system, const Vector& x, const std::string& word) {
  const int n = system.num_constraints();
  if (word.size() != static_cast<std::size_t>(n)) {
    throw py::value_error("mode is '" + word + "', expected names, or a word of " +
                          std::to_string(n) + " letters");
  }
  const Vector v = x.tail(system.dof());
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), v, &terms);
  const double rest = SimulateOptions().speed_tolerance;
  ContactMode mode;
  for (int i = 0; i < n; ++i) {
    const char letter = word[static_cast<std::size_t>(i)];
    const Friction none;
    const Friction& friction = system.HasFriction() ? system.friction()[i] : none;
    const bool rough = friction.dimension > 0, plane = friction.dimension == 1;
    const std::string own = plane ? "os+-" : rough ? "osl" : "ol";
    const auto refuse = [&](const std::string& why) {
      throw py::value_error("mode is '" + word + "': '" +
                            system.description().constraints[static_cast<std::size_t>(i)] + "' " +
                            why);
    };
    if (own.find(letter) == std::string::npos) refuse("has the letters " + own);
    mode.Set(i, static_cast<Letter>(letter));
    if (!rough || letter == 'o') continue;
    const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * v;
    if (letter == 's' && slip.norm() > rest) refuse("slips at " + Number(slip.norm()) + " m/s");
    if (letter == 'l' && slip.norm() <= rest) refuse("does not slip: it has no direction to");
    if ((letter == '+' && slip(0) < -rest) || (letter == '-' && slip(0) > rest)) {
      refuse("slips at " + Number(slip(0)) + " m/s");
    }
  }
  return mode;
}

/// The contact mode of an argument: None, that of the state; names; or a word of letters.
/// Whether a contact with friction sticks or slips, and where to, names do not say: they are those
/// of the state then, which a word may differ from.
ContactMode ModeOf(const System& s, const Vector& x, const Vector& u, const py::handle& mode) {
  if (mode.is_none()) return InitialMode(s.get(), x, u);
  const SystemDescription& names = s.description();
  if (py::isinstance<py::str>(mode)) return ToWord(s.get(), x, py::str(mode));
  const ConstraintSet asked = ToContacts(mode, names);
  if (!s.get().HasFriction() || asked.Empty()) return ContactMode(asked);
  const ContactMode own = InitialMode(s.get(), x, u);
  if (own.Members() == asked) return own;
  throw py::value_error("mode is " + asked.ToString(names.constraints) + ", that of x is " +
                        own.ToString(names.constraints) +
                        ": whether contacts with friction stick or slip there a word says, as "
                        "'" +
                        own.Word(s.get().num_constraints()) + "'");
}

py::tuple Accelerations(const System& s, const py::handle& x, const py::handle& u,
                        const py::handle& mode, bool jacobians) {
  const Vector state = Finite(ToState(s, x), "x"), input = Finite(ToInput(s, u), "u");
  const ContactMode contacts = ModeOf(s, state, input, mode);
  Variables variables;
  variables.inputs = true;
  ContactDynamics dynamics(s.get(), input, variables);
  if (!jacobians) {
    dynamics.Evaluate(state, contacts);
    return py::make_tuple(dynamics.acceleration(), dynamics.force());
  }
  dynamics.Differentiate(state, contacts);
  return py::make_tuple(dynamics.acceleration(), dynamics.force(), dynamics.acceleration_jacobian(),
                        dynamics.force_jacobian());
}

/// (1b), of contacts with friction (F6).
ImpactResult Impact(const System& s, const Vector& q, const Vector& v, ConstraintSet touching) {
  if (!s.get().HasFriction()) return SolveImpact(s.get(), q, v, touching);
  try {
    return SolveFrictionalImpact(s.get(), q, v, touching).result;
  } catch (const FrictionRefusal& reason) {
    throw py::value_error(reason.what());
  }
}

}  // namespace

void BindTerms(py::module_* module) {
  auto system = py::class_<System, std::shared_ptr<System>>(module->attr("System"));
  system
      .def(
          "mass_matrix",
          [](const System& s, const py::object& q) {
            Matrix mass;
            Vector force;
            const Vector zero = Vector::Zero(s.get().dof());
            s.get().Dynamics(Positions(s, q), zero, s.get().nominal().u, {}, &mass, &force);
            return mass;
          },
          py::arg("q"), "M(q) [d×d].")
      .def(
          "force",
          [](const System& s, const py::object& q, const py::object& v, const py::object& u,
             const py::object& mode) {
            Vector force;
            s.get().Dynamics(Positions(s, q), Velocities(s, v), Finite(ToInput(s, u), "u"),
                             ContactMode(ToContacts(mode, s.description())), nullptr, &force);
            return force;
          },
          py::arg("q"), py::arg("v"), py::arg("u") = py::none(), py::arg("mode") = py::tuple(),
          "f(q, v, u, J) + c(q, v) v [d]; `mode` are the names of J.")
      .def(
          "gaps",
          [](const System& s, const py::object& q) {
            const Vector zero = Vector::Zero(s.get().dof());
            const ConstraintTerms terms = Constraints(s, Positions(s, q), zero);
            return Vector(terms.gap.head(s.get().num_constraints()));
          },
          py::arg("q"), "a(q) [n], [m] or [rad].")
      .def(
          "constraint_terms",
          [](const System& s, const py::object& q, const py::object& v) {
            ConstraintTerms terms = Constraints(s, Positions(s, q), Velocities(s, v));
            return py::make_tuple(terms.gap, terms.jacobian, terms.bias);
          },
          py::arg("q"), py::arg("v"),
          "(a, Da, (d/dt Da) v): [n+l+r], [n+l+r × d], [n+l+r]; unilateral constraints first,\n"
          "then bilateral ones, then the rows of the tangential maps.")
      .def(
          "accelerations",
          [](const System& s, const py::object& x, const py::object& u, const py::object& mode) {
            return Accelerations(s, x, u, mode, false);
          },
          py::arg("x") = py::none(), py::arg("u") = py::none(), py::arg("mode") = py::none(),
          "(v̇ [d], λ [n+l+r]) of (1a) in a contact mode, that of the state where none is given:\n"
          "names, or a word as in Run.mode_words. Names do not say what friction does: with it\n"
          "ValueError where the state's own mode has other names, or the velocity another letter.")
      .def(
          "acceleration_jacobians",
          [](const System& s, const py::object& x, const py::object& u, const py::object& mode) {
            return Accelerations(s, x, u, mode, true);
          },
          py::arg("x") = py::none(), py::arg("u") = py::none(), py::arg("mode") = py::none(),
          "(v̇, λ, Dv̇ [d × 2d+m], Dλ [n+l+r × 2d+m]), by (δq, δv, δu). Of contacts that share "
          "forces,\n"
          "as two points of a body that sticks, Dλ is that of the share furthest within their "
          "cones.")
      .def(
          "initial_mode",
          [](const System& s, const py::object& x, const py::object& u, const py::kwargs& options) {
            const SimulateOptions o = ToOptions(options, SimulateOptions());
            return ToNames(InitialMode(s.get(), ToState(s, x), ToInput(s, u), o), s.description());
          },
          py::arg("x") = py::none(), py::arg("u") = py::none(),
          "Names of the contacts that hold at a state. ValueError for a state that penetrates.")
      .def(
          "impact",
          [](const System& s, const py::object& q, const py::object& v,
             const py::object& touching) {
            const ImpactResult impact =
                Impact(s, Positions(s, q), Velocities(s, v), ToContacts(touching, s.description()));
            return py::make_tuple(impact.v_plus, impact.impulse,
                                  ToNames(impact.hit, s.description()));
          },
          py::arg("q"), py::arg("v"), py::arg("touching"),
          "(v⁺ [d], p [n+l+r] [N·s], names that were hit) of the impact (1b), with friction by\n"
          "Coulomb's law in the impulses. ValueError where no or several v⁺ fit.")
      .def(
          "perturb",
          [](const System& s, const py::object& x, const py::object& w) {
            return s.get().Perturb(Finite(ToState(s, x), "x"),
                                   Finite(ToVector(w, "w", 2 * s.get().dof()), "w"));
          },
          py::arg("x"), py::arg("w"), "x ⊞ w for a tangent w = (δq, δv) [2d].")
      .def(
          "project",
          [](const System& s, const py::object& x) {
            Vector state = Finite(ToState(s, x), "x");
            if (ProjectState(s.get(), &state)) return state;
            throw py::value_error("x is too far from its closed loops: give angles nearer to them");
          },
          py::arg("x"),
          "The state on closed loops near x: unit quaternions, b(q) = 0 and Db v = 0, by the\n"
          "shortest moves in the kinetic metric. ValueError where there is none near.")
      .def(
          "separation",
          [](const System& s, const py::object& to, const py::object& from) {
            return s.get().Separation(Finite(ToState(s, to), "to"),
                                      Finite(ToState(s, from), "from_"));
          },
          py::arg("to"), py::arg("from_"), "The tangent w [2d] with perturb(from_, w) = to.");
}

}  // namespace python
}  // namespace contact_flow
