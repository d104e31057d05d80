// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/dynamics/friction_problem.h"

namespace contact_flow {

/// What the letters of some contacts imply for others, where rows of the contacts are dependent.
class ImpliedLetters {
 public:
  explicit ImpliedLetters(const FrictionProblem& problem);

  /// Whether the rows of all contacts are dependent.
  bool Any() const { return any_; }
  /// Whether those are that vanish in a word.
  bool Dependent(const std::vector<Letter>& letters) const;
  /// Whether a contact is open in a word which keeps its gap closed, or begins to slip in one that
  /// keeps it from slipping.
  bool Change(const std::vector<Letter>& letters) const;
  /// The word with those sticking instead.
  std::vector<Letter> Stuck(const std::vector<Letter>& letters) const;

 private:
  std::vector<int> Rows(const std::vector<Letter>& letters) const;
  bool Depends(int row, const std::vector<int>& basis) const;

  const FrictionProblem& problem_;
  bool any_ = false;
};

/// SolveWord where the word's `rows` are dependent, or its matrix is singular. `columns` are those
/// of its multipliers, by row of the problem.
bool SolveDependentWord(const FrictionProblem& problem, const Matrix& columns,
                        const std::vector<int>& rows, bool share, FrictionSolution* solution);

}  // namespace contact_flow
