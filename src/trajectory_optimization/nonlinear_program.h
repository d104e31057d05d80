// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// min f(x) under bounds of x and of the rows r(x), with first derivatives.
struct NonlinearProgram {
  Vector start, lower, upper;                // [n]
  Vector row_lower, row_upper;               // [rows]
  std::vector<std::pair<int, int>> pattern;  // (row, column) of the entries of ∂r/∂x
  double tolerance = 1e-9;
  int max_iterations = 500;
  /// f and r; false where there are none.
  std::function<bool(const Vector& x, double* f, Vector* rows)> evaluate;
  /// Their derivatives, entries in the order of the pattern; false where there are none.
  std::function<bool(const Vector& x, Vector* gradient, Vector* entries)> differentiate;
  /// After each iteration; false ends the search.
  std::function<bool(int iteration, double f, double violation, const Vector& x)> progress;
};

/// Where it ended.
struct NonlinearSolution {
  enum class Status { kConverged, kInfeasible, kMaxIterations, kCancelled, kUndefined, kStalled };
  Status status = Status::kStalled;
  std::string message;  // as Ipopt calls it
  Vector x, multipliers;
};

/// By Ipopt, with a quasi-Newton second order. Rethrows what the functions throw. Throws
/// std::runtime_error where it is not compiled in.
NonlinearSolution SolveByIpopt(const NonlinearProgram& program);

}  // namespace contact_flow
