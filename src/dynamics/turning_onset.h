// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "contact_flow/dynamics/friction_problem.h"
#include "contact_flow/dynamics/word_selection.h"

/// Slips of one body that begin together in several directions, as it turns.
namespace contact_flow {

/// The word that follows where contacts stick, and of all their shares the last one that is
/// admissible is left: it has contacts on their cones, which begin to slip against the forces that
/// they have there. `stuck` is the word in which they stick, with its most interior share. The
/// motion is the same, and forces are; the bodies can move so, as directions and speeds are those
/// of the normal of the set of forces that the contacts can take. Nothing where shares are left,
/// where a contact lets go there, or where that word is another motion; inequalities may miss
/// `border`, relative, and the slack of the problem.
std::optional<FrictionSolution> FindTurningOnset(const FrictionProblem& problem,
                                                 const FrictionSolution& stuck, double border);

/// Whether all contacts that begin to slip by a word may do so: not a corner on its cone by one of
/// many shares, which the other corners of the body hold along its direction.
bool SlipsMayBegin(const FrictionProblem& problem, const FrictionSolution& word);

/// Relative speeds κ by contact, the largest 1, with which those of a word that begin to slip in
/// space may move together: A v = κ d in their rows, and 0 in the others of the word, has a
/// solution v. 1 for each where all speeds may be equal, or no others have the sign of d. Zero for
/// the contacts that do not begin to slip.
Vector OnsetSpeeds(const FrictionProblem& problem, const FrictionSolution& word);

/// The change of v [d] that gives the slips of a word which begin in space at most this speed, and
/// none to the contacts that stick; empty where none begins.
Vector BegunMotion(const FrictionFrame& frame, const FrictionSolution& word, double speed);

}  // namespace contact_flow
