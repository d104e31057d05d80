// SPDX-License-Identifier: BSD-3-Clause
#include "window.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace contact_flow {
namespace {

/// Less than this part of an interval of the grid belongs to the next one.
constexpr double kLeastPart = 0.25;

}  // namespace

void RequireHorizon(bool condition, const std::string& what) {
  if (!condition) throw std::invalid_argument("receding horizon: " + what);
}

Window WindowAt(const HorizonProblem& problem, double begin) {
  const TrajectoryProblem& whole = problem.whole;
  const int count = static_cast<int>(whole.inputs.grid.size());
  const auto instant = [&whole, count](int k) {
    return k < count ? whole.inputs.grid[static_cast<std::size_t>(k)]
                     : whole.inputs.grid.front() + whole.duration;
  };
  Window window;
  window.problem = whole;
  window.problem.conditions.clear();
  window.problem.inputs = {};
  int first = 1;
  while (first <= count &&
         instant(first) - begin < kLeastPart * (instant(first) - instant(first - 1))) {
    ++first;
  }
  window.first = first;
  if (first > count) return window;
  const int last = problem.intervals > 0 ? std::min(first + problem.intervals - 1, count) : count;
  window.end = instant(last);
  window.problem.duration = window.end - begin;
  InputSchedule& inputs = window.problem.inputs;
  for (int k = first; k <= last; ++k) {
    inputs.grid.push_back(k == first ? begin : instant(k - 1));
    inputs.values.push_back(whole.inputs.values[static_cast<std::size_t>(k - 1)]);
  }
  const auto part = [&](const Matrix& columns) -> Matrix {
    return columns.size() > 0 ? columns.middleCols(first - 1, last - first + 1) : Matrix();
  };
  window.problem.input_path = part(whole.input_path);
  window.problem.path_reference = part(whole.path_reference);
  if (problem.goals.size() > 0) window.problem.target = problem.goals.col(last - 1);
  for (TrajectoryCondition condition : whole.conditions) {
    if (condition.number < first || condition.number > last) continue;
    condition.number -= first - 1;
    window.problem.conditions.push_back(condition);
  }
  return window;
}

void CheckHorizon(const MechanicalSystem& system, const HorizonProblem& problem) {
  const TrajectoryProblem& whole = problem.whole;
  const Unknowns unknowns(system, whole);  // throws for what is wrong with it anyway
  RequireHorizon(whole.choose_inputs && whole.choose_initial.empty() &&
                     whole.choose_parameters.empty() && whole.choose_durations.empty(),
                 "inputs alone may be chosen");
  RequireHorizon(!whole.linear_inputs, "inputs are held, not led linearly (linear_inputs)");
  RequireHorizon(problem.intervals >= 0, "intervals must be ≥ 0");
  const auto count = static_cast<Eigen::Index>(whole.inputs.grid.size());
  RequireHorizon(
      problem.goals.size() == 0 || (problem.goals.rows() == system.state_size() &&
                                    problem.goals.cols() == count && problem.goals.allFinite()),
      "goals must be finite, with a column for each instant");
  for (const TrajectoryCondition& condition : whole.conditions) {
    RequireHorizon(condition.kind == TrajectoryCondition::Kind::kState,
                   "a condition on a touchdown is none of a window");
  }
}

}  // namespace contact_flow
