// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A nonsmooth equation at one point: r(x) and its B-derivative.
struct EquationValue {
  bool defined = true;     ///< false: x lies outside the domain, `message` says why
  Vector residual;         ///< r(x) [m]
  Vector error;            ///< what |r(x)| is known to [m]; empty: to rounding
  bool has_map = false;    ///< whether `map` is given
  PiecewiseLinearMap map;  ///< δx ↦ Dr(x; δx) [m×n]
  std::string message;     ///< why there is none
};

/// Evaluates r at x [n]; the map is wanted only when `with_map`.
using NonsmoothEquation = std::function<EquationValue(const Vector& x, bool with_map)>;

/// How B-Newton ended.
enum class NewtonStatus {
  kConverged = 0,  ///< |r|_∞ ≤ tolerance, or r is within its error and no step makes it smaller
  kStationary =
      1,  ///< |r|² has no descent to first order: a least-squares solution, or a kink in the way
  kStalled =
      2,  ///< no step along the direction made |r|² smaller: rounding, or a map that is not Dr
  kUndefined = 3,  ///< r or its map is not to be had at the start or at an iterate
  kMaxIterations = 4,
  kCancelled = 5,
};

/// "converged", …
const char* NewtonStatusName(NewtonStatus status);

/// One iterate.
struct NewtonIteration {
  int iteration = 0;    ///< 0: the start
  double residual = 0;  ///< |r|_∞
  double step = 0;      ///< length t of the step that led here, 1 for a full one
  int piece = -1;       ///< the piece whose solution was followed
  bool in_cone =
      false;  ///< whether it lay in its own cone: an exact solution of the piecewise-linear model
};

/// Settings of B-Newton.
struct NewtonOptions {
  double tolerance = 1e-11;  ///< of |r|_∞
  int max_iterations = 50;   ///< at most
  int max_halvings = 30;     ///< of a step
  double max_step = 0;       ///< longest |δx|₂ of a step; 0: no limit
  double armijo =
      1e-4;  ///< share of the decrease of |r|² promised to first order that a step must bring
  /// Singular values below this part of a piece's largest are zero: the shortest step is taken.
  double rank_tolerance = 1e-10;
  /// x ⊞ δx; x + δx when empty.
  std::function<Vector(const Vector& x, const Vector& step)> add;
  /// Told of each iterate, the start included; returning false ends the search.
  std::function<bool(const NewtonIteration&, const Vector& x)> progress;
};

/// Where B-Newton ended.
struct NewtonResult {
  NewtonStatus status = NewtonStatus::kUndefined;  ///< how it ended
  std::string message;                             ///< why, as a sentence
  Vector x;                                        ///< the best iterate
  Vector residual;                                 ///< r(x)
  std::vector<NewtonIteration> iterations;         ///< in their order

  /// Whether it has converged.
  bool ok() const { return status == NewtonStatus::kConverged; }
};

/// A solution of r + f(d) = 0 for a piecewise-linear f, or what comes nearest.
struct PiecewiseLinearStep {
  Vector d;              ///< [n]
  double model = 0;      ///< |r + f(d)|₂
  int piece = -1;        ///< the one whose cone the step is in
  bool in_cone = false;  ///< d is the solution of the piece whose cone holds it
};

/// Solves A_i d = −r for every piece, by least squares where there are more conditions than
/// unknowns and by the shortest d where there are fewer, and returns the d with the least |r +
/// f(d)|, among equals the shortest. With fewer conditions, where no shortest solution lies in its
/// own cone, any one in its cone (a linear program).
PiecewiseLinearStep SolvePiecewiseLinear(const PiecewiseLinearMap& map, const VectorRef& residual,
                                         double rank_tolerance = 1e-10);

/// B-Newton for r(x) = 0: d solves r + Dr(x; d) = 0 over the pieces, x ← x ⊞ t d with t = 1, ½, ¼,
/// …, the first that Armijo's rule accepts on |r|². Near a root whose pieces are all regular the
/// convergence is quadratic, on a kink or off it.
NewtonResult SolveEquation(const NonsmoothEquation& equation, const VectorRef& start,
                           const NewtonOptions& options = {});

}  // namespace contact_flow
