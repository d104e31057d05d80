// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A solution, with the mode that its letters make.
struct WordAhead {
  ContactMode mode;
  FrictionSolution solution;
};

/// The word at a border, where the motion of `along` is that of several words and slips that begin
/// have no direction yet: the only one that fits a little later along it. There what `along` takes
/// is missing, and the others have accelerations of their own; the time is the shortest of a few
/// at which a single word is left. Nothing where none, or several, fit at all of them. Where it is
/// known that `along` ends, a time is too short at which springs hold it still.
std::optional<WordAhead> FindWordAhead(ContactDynamics* dynamics, const Vector& x,
                                       const TouchingContacts& touching, const ContactMode& along,
                                       double border, bool ends = false);

/// Whether springs hold a contact here that they hold no more a little later, where all slips go
/// on: their forces in the cones of this mode cease to exist, as two solutions of theirs meet.
bool SpringsLetGo(ContactDynamics* dynamics, const Vector& x, const ContactMode& mode);

}  // namespace contact_flow
