// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// Motions that differ by less than this are one, relative.
constexpr double kSameGroupMotion = 1e-8;
/// A slack above this is room, relative.
constexpr double kRoom = 1e-7;

/// The letters that a contact may have.
std::vector<Letter> AlphabetOf(const FrictionContact& contact);

/// Whether a contact with this letter slips, or begins to.
bool Slips(Letter letter);

/// All contacts open; `result` is what follows.
FrictionSolution WithoutForces(const FrictionProblem& problem, const Vector& result);

/// The slack of the tightest inequality, with what it may miss, relative to `scale`.
double Margin(const FrictionProblem& problem, const FrictionSolution& s, double scale);

/// Whether `other` is the motion of `word` with less contact, or less that sticks, where `word` has
/// room for it: a box on a diagonal of its face.
bool Covers(const FrictionProblem& problem, const FrictionSolution& word,
            const FrictionSolution& other, double scale);

/// Whether a contact that rises in `one`, with room, presses in `other`: then no share of the
/// forces of `other` leads to the motion of `one`.
bool RisesBeside(const FrictionProblem& problem, const FrictionSolution& one,
                 const FrictionSolution& other, double scale);

}  // namespace contact_flow
