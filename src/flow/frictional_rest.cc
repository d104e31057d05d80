// SPDX-License-Identifier: BSD-3-Clause
#include "frictional_rest.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"
#include "contact_flow/model/row_layout.h"
#include "slip_onset.h"
#include "src/dynamics/implied_contacts.h"
#include "src/dynamics/rest_impulse.h"

namespace contact_flow {
namespace {

/// How closely an inequality of a word has to hold, relative.
constexpr double kRestBorder = 1e-10;
/// A slip in space that begins with the rest has this many absolute tolerances.
constexpr double kRestOnset = 10;
/// Slip that is rounding, relative to the velocities at both sides of the last impact.
constexpr double kNoSlip = 1e-12;

Letter LetterOf(const Friction& friction, double slip) {
  if (friction.dimension != 1 || !(friction.coefficient > 0)) return Letter::kSlip;
  return slip > 0 ? Letter::kForward : Letter::kBackward;
}

}  // namespace

std::optional<FrictionalRest> RestOfBounces(ContactDynamics* dynamics, const Transition& last,
                                            ConstraintSet closed, double gap_tolerance) {
  const MechanicalSystem& system = dynamics->system();
  const int nq = system.num_positions(), d = system.dof(), n = system.num_constraints();
  Vector x = last.x_plus;
  const Vector v = x.tail(d);
  ConstraintTerms terms;
  system.Constraints(x.head(nq), v, &terms);
  FrictionalRest rest;
  rest.closed = closed;
  ConstraintSet near;
  for (int i = 0; i < n; ++i) {
    const bool beside = !rest.closed.Contains(i) && !system.compliant().Contains(i);
    if (beside && std::abs(terms.gap(i)) <= gap_tolerance) near.Insert(i);
  }
  if (!near.Empty()) rest.closed = rest.closed | ImpliedClosed(system, x, rest.closed, near);
  if ((rest.closed - last.mode_after).Empty()) {  // they do already
    rest.v_plus = v;
    rest.mode = last.mode_after;
    rest.energy_lost = 0;
    return rest;
  }

  const double still = kNoSlip * std::max(v.norm(), last.x_minus.tail(d).norm());
  const ConstraintSet sticking = last.mode_before.Sticking() | last.mode_after.Sticking();
  ContactMode word;
  for (int i : rest.closed) {
    const Friction& friction = system.friction()[i];
    const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * v;
    const bool sticks = sticking.Contains(i) || !(slip.norm() > still);
    word.Set(i, sticks ? Letter::kStick : LetterOf(friction, slip.size() > 0 ? slip(0) : 0));
  }
  const InverseInertia inertia(system, x.head(nq), v);
  const RestImpulse impulse = BringToRest(system, inertia, v, word);
  rest.v_plus = impulse.v_plus;
  if (!rest.v_plus.allFinite()) return std::nullopt;
  Vector pushed = impulse.impulse;
  RowLayout(system).Bilateral(pushed).setZero();
  rest.energy_lost = -0.5 * pushed.dot(terms.jacobian * (v + rest.v_plus));  // from the surfaces

  x.tail(d) = rest.v_plus;
  TouchingContacts contacts;
  for (int i : rest.closed) {
    const Friction& friction = system.friction()[i];
    const Vector slip = terms.jacobian.middleRows(friction.row, friction.dimension) * rest.v_plus;
    const bool none = slip.norm() <= std::max(still, kNoSlip * rest.v_plus.norm());
    if (friction.dimension > 0 && friction.coefficient > 0 && (sticking.Contains(i) || none)) {
      contacts.still.Insert(i);
    } else {
      contacts.slipping.Set(i, LetterOf(friction, slip.size() > 0 ? slip(0) : 0));
    }
  }
  try {
    WordConventions by;
    rest.mode = SelectWord(dynamics, x, contacts, kRestBorder, &by);
  } catch (const FrictionRefusal&) {
    return std::nullopt;
  }
  const ConstraintSet begins = BeginInSpace(system, contacts.still, rest.mode);
  if (begins.Empty()) return rest;
  try {
    auto onsets = OnsetDirections(dynamics, x, contacts, rest.mode, begins, kRestBorder);
    for (auto& [i, onset] : onsets) onset *= kRestOnset * last.absolute_tolerance;
    MakeRest(system, rest.mode, onsets, &x);
  } catch (const FrictionRefusal&) {
    return std::nullopt;
  }
  rest.v_plus = x.tail(d);
  return rest;
}

}  // namespace contact_flow
