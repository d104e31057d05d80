// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// The word with these letters, with its margin relative to `scale`, where contacts may have them
/// and directions are known.
std::optional<FrictionSolution> SolveLetters(const FrictionProblem& problem,
                                             const std::vector<Letter>& letters, double scale);

/// The letters in which all that may stick does.
std::vector<Letter> StickingLetters(const FrictionProblem& problem);

/// Solutions of contacts with independent rows that are too many for all words to be tried: the
/// first with more room than `room` that is shown to be the only one, of the letters until now, all
/// sticking, all open, and those that SolveEqualSprings comes to. Else all of them that fit, and,
/// where one is on a border, the words that meet there. Unless these are shown to be all there is
/// `springs` is set: other words were not looked for. Empty where none is found.
std::vector<FrictionSolution> SearchWords(const FrictionProblem& problem, double border,
                                          double room, const std::vector<Letter>& before);

}  // namespace contact_flow
