// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/row_layout.h"
#include "dependent_row.h"
#include "slip_onset.h"
#include "src/dynamics/mode_selection.h"

namespace contact_flow {
namespace {

/// A quaternion this far from unit length was meant to be one, and is made one.
constexpr double kUnitTolerance = 1e-6;

[[noreturn]] void Refuse(const std::string& field, double value, const std::string& rule) {
  std::ostringstream message;
  message << field << " is " << value << ": it must be " << rule;
  throw std::invalid_argument(message.str());
}

void RequireSize(const char* what, Eigen::Index size, int wanted) {
  if (size == wanted) return;
  throw std::invalid_argument(std::string(what) + " has " + std::to_string(size) +
                              " entries: " + std::to_string(wanted) + " are needed");
}

void RequireFinite(const char* what, const VectorRef& values,
                   const std::vector<std::string>& names) {
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values(i))) {
      Refuse(std::string(what) + " '" + names[i % names.size()] + "'", values(i), "finite");
    }
  }
}

/// Refuses a state off b(q) = 0, Db v = 0 or with a quaternion that is not a unit one.
void RequireOnManifold(const MechanicalSystem& system, const VectorRef& x,
                       const ConstraintTerms& terms, const Vector& rate,
                       const SimulateOptions& options) {
  const SystemDescription& names = system.description();
  const ConfigurationSpace& space = system.space();
  for (const ConfigurationSpace::Rotation& rotation : space.rotations()) {
    const double norm = x.segment<4>(rotation.q).norm();
    if (!(std::abs(norm - 1) <= kUnitTolerance)) {
      Refuse("the norm of the quaternion that begins with '" + names.coordinates[rotation.q] + "'",
             norm, "1");
    }
  }
  for (int i = 0; i < system.num_bilateral(); ++i) {
    const int row = RowLayout(system).OfBilateral(i);
    if (!(std::abs(terms.gap(row)) <= options.gap_tolerance)) {
      Refuse("bilateral constraint '" + names.bilateral[i] + "'", terms.gap(row),
             "0 (the initial state does not meet it)");
    }
    if (!(std::abs(rate(row)) <= options.speed_tolerance)) {
      Refuse("the rate of bilateral constraint '" + names.bilateral[i] + "'", rate(row),
             "0 (the initial velocity leaves it)");
    }
  }
}

/// Refuses bilateral rows of which one depends on those before: closures that hold the same twice,
/// or a loop at the end of its reach. Their forces are not unique, and the loop may branch.
void RequireIndependent(const MechanicalSystem& system, const ConstraintTerms& terms) {
  constexpr double kRank = 1e-9;
  if (system.num_bilateral() == 0) return;
  const DependentRow lost = MostDependent(RowLayout(system).Bilateral(terms.jacobian));
  if (lost.part > kRank) return;
  throw std::invalid_argument(
      "bilateral constraint '" + system.description().bilateral[lost.row] +
      "' depends on those before it in this state: it holds what they hold, or its loop is "
      "stretched out; leave it out, or begin elsewhere");
}

/// Refuses what contacts with friction would otherwise pass over.
void RequireWhatFrictionKnows(const MechanicalSystem& system, const SimulateOptions& options) {
  const std::string name = "system '" + system.description().name + "' has friction";
  if (!system.compliant().Empty() || system.HasContactEffort()) {
    throw std::invalid_argument(name +
                                ": compliant constraints and efforts that depend on the "
                                "contact mode are not offered with it");
  }
  if (options.impact_law != ImpactLaw::kComplementarity) {
    throw std::invalid_argument(name + ": impact_law has to be complementarity");
  }
}

/// The letters of a start whose candidates touch and rest in normal direction.
ContactMode InitialWord(ContactDynamics* dynamics, const VectorRef& x, ConstraintSet candidates,
                        const SimulateOptions& options) {
  constexpr double kBorder = 1e-10;
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector rate = terms.jacobian * x.tail(d);
  TouchingContacts contacts;
  for (int i : candidates) {
    const Friction& friction = system.friction()[i];
    if (friction.dimension == 0) {
      contacts.slipping.Insert(i);
      continue;
    }
    const auto slip = rate.segment(friction.row, friction.dimension);
    const bool still = slip.norm() <= options.speed_tolerance;
    if (std::isinf(friction.coefficient) && !still) {
      Refuse("the slip of touching constraint '" + system.description().constraints[i] +
                 "', which never slips,",
             slip.norm(), "0");
    }
    if (still && friction.coefficient > 0) {
      contacts.still.Insert(i);
    } else if (friction.dimension == 1 && friction.coefficient > 0) {
      contacts.slipping.Set(i, slip(0) > 0 ? Letter::kForward : Letter::kBackward);
    } else {
      contacts.slipping.Insert(i);
    }
  }
  WordConventions by;
  const ContactMode word = SelectWord(dynamics, x, contacts, kBorder, &by);
  if (by.smallest) SelectWord(dynamics, x, contacts, kBorder);  // throws: no start decides
  const ConstraintSet begins = BeginInSpace(system, contacts.still, word);
  if (!begins.Empty()) OnsetDirections(dynamics, x, contacts, word, begins, kBorder);  // or throws
  return word;
}

}  // namespace

void Validate(const SimulateOptions& options) {
  const auto positive = [](const char* name, double value) {
    if (!(value > 0) || !std::isfinite(value)) Refuse(name, value, "finite and positive");
  };
  positive("relative_tolerance", options.relative_tolerance);
  positive("absolute_tolerance", options.absolute_tolerance);
  positive("gap_tolerance", options.gap_tolerance);
  positive("speed_tolerance", options.speed_tolerance);
  positive("zeno_interval", options.zeno_interval);
  positive("max_seconds", options.max_seconds);
  positive("max_megabytes", options.max_megabytes);
  if (options.relative_tolerance < 1e-14 || options.relative_tolerance > 1e-2) {
    Refuse("relative_tolerance", options.relative_tolerance, "in [1e-14, 1e-2]");
  }
  if (options.absolute_tolerance < 1e-15 || options.absolute_tolerance > 1e-2) {
    Refuse("absolute_tolerance", options.absolute_tolerance, "in [1e-15, 1e-2]");
  }
  if (!(options.simultaneity_tolerance >= 0) || !std::isfinite(options.simultaneity_tolerance)) {
    Refuse("simultaneity_tolerance", options.simultaneity_tolerance, "finite and not negative");
  }
  if (!(options.max_step >= 0)) Refuse("max_step", options.max_step, "not negative");
  if (options.max_steps < 1)
    Refuse("max_steps", static_cast<double>(options.max_steps), "at least 1");
  if (options.max_events < 0)
    Refuse("max_events", static_cast<double>(options.max_events), "not negative");
}

ContactMode InitialMode(const MechanicalSystem& system, const VectorRef& x, const VectorRef& u,
                        const SimulateOptions& options) {
  if (system.HasFriction()) RequireWhatFrictionKnows(system, options);
  const SystemDescription& names = system.description();
  const int d = system.dof(), nq = system.num_positions();
  RequireSize("the initial state (q, v)", x.size(), nq + d);
  RequireSize("the input u", u.size(), system.num_inputs());
  RequireFinite("position of", x.head(nq), names.coordinates);
  RequireFinite("velocity of", x.tail(d), names.velocities);
  RequireFinite("input", u, names.inputs);
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  const Vector rate = terms.jacobian * x.tail(d);
  RequireOnManifold(system, x, terms, rate, options);
  RequireIndependent(system, terms);
  ConstraintSet candidates, pressed;
  for (int i = 0; i < system.num_constraints(); ++i) {
    const std::string& name = names.constraints[i];
    if (system.compliant().Contains(i)) {
      const bool touching = std::abs(terms.gap(i)) <= options.gap_tolerance;
      if (touching ? rate(i) < 0 : terms.gap(i) < 0) pressed.Insert(i);
      continue;
    }
    if (!(terms.gap(i) >= -options.gap_tolerance)) {
      Refuse("the gap of constraint '" + name + "'", terms.gap(i),
             "not negative (the initial state penetrates: begin elsewhere, or give the "
             "constraint another place)");
    }
    if (terms.gap(i) > options.gap_tolerance) continue;
    if (rate(i) < -options.speed_tolerance) {
      Refuse("the gap rate of touching constraint '" + name + "'", rate(i),
             "not negative (the initial velocity moves into an active contact)");
    }
    if (rate(i) <= options.speed_tolerance) candidates.Insert(i);
  }
  if (candidates.Empty()) return ContactMode(pressed);
  ContactDynamics dynamics(system, u);
  try {
    if (system.HasFriction()) return InitialWord(&dynamics, x, candidates, options);
    return SelectContactMode(&dynamics, x, candidates, {}, pressed);
  } catch (const FrictionRefusal& reason) {
    throw std::invalid_argument(std::string("the initial state: ") + reason.what());
  } catch (const UndecidedMode& reason) {
    throw std::invalid_argument(std::string("the initial state: ") + reason.what());
  } catch (const std::domain_error& reason) {
    throw std::invalid_argument(std::string("the initial state: ") + reason.what());
  }
}

}  // namespace contact_flow
