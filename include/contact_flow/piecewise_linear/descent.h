// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact_flow/piecewise_linear/kink.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What is asked of a cost at a point.
enum class CostQuery {
  kValue = 0,
  kSlopes = 1,  ///< with its B-derivative
  kKinks = 2,   ///< with that of the nearest kink, where one is near: events that nearly coincide
                ///< are taken as one
};

/// A cost at one point.
struct CostValue {
  bool defined = true;     ///< false: the point lies outside the domain, `message` says why
  double cost = 0;         ///< its value
  bool has_map = false;    ///< whether `map` is given
  PiecewiseLinearMap map;  ///< δy ↦ DJ(y; δy) [1×n]
  std::string message;     ///< why there is none
};

/// The cost at a point.
using NonsmoothCost = std::function<CostValue(const Vector& y, CostQuery query)>;

/// How the descent ended.
enum class DescentStatus {
  kMinimum = 0,  ///< no direction makes the cost smaller to first order
  kStalled = 1,  ///< some direction should, but no step along it did: rounding, or a kink close by
  kUndefined = 2,  ///< the cost or its derivative is not to be had at the start
  kMaxIterations = 3,
  kCancelled = 5,
};

/// "minimum", …
const char* DescentStatusName(DescentStatus status);

/// What an iteration went along.
enum class DescentMethod {
  kStart = 0,
  kTrustRegion = 1,  ///< a step of steepest descent on the piecewise-linear model
  kBfgs = 2,         ///< a quasi-Newton step
};

/// One iterate.
struct DescentIteration {
  int iteration = 0;                             ///< from 0 on
  double cost = 0;                               ///< at the best point
  double step = 0;                               ///< |δy|_∞ of the step that led here
  DescentMethod method = DescentMethod::kStart;  ///< what it went along
};

/// Settings of the descent.
struct DescentOptions {
  double tolerance = 1e-8;         ///< of the slope along |d|_∞ = 1 that counts as none
  int max_iterations = 200;        ///< at most
  double radius = 0.1;             ///< first radius of the trust region, |δy|_∞
  double smallest_radius = 1e-11;  ///< steps are no shorter
  int patience = 3;                ///< steps refused in a row by the trust region before BFGS
  double kink_tolerance = 1e-7;    ///< gradients that differ by less, relative, make no kink
  std::function<bool(const DescentIteration&, const Vector& y)>
      progress;  ///< false ends the search
};

/// Where the descent ended.
struct DescentResult {
  DescentStatus status = DescentStatus::kUndefined;  ///< how it ended
  std::string message;                               ///< why, as a sentence
  Vector y;                                          ///< the best iterate
  double cost = 0;                                   ///< there
  SteepestDescent steepest;                  ///< at y; its slope is 0 to `tolerance` at a minimum
  std::vector<Kink> kinks;                   ///< at y: all valleys where y is a minimum on a kink
  std::vector<DescentIteration> iterations;  ///< in their order
};

/// Minimises a piecewise differentiable cost. Steepest descent on its piecewise-linear model within
/// a trust region
///   min J + DJ(y; d),  |d|_∞ ≤ Δ   (linear programs),
/// which follows kinks where the model has them; where its steps are refused, BFGS with a line
/// search to the weak conditions of Wolfe (Lewis and Overton), which needs no kink in the model; in
/// turns, until neither moves. Throws std::invalid_argument, naming field and value, for a radius
/// that is not positive and for a tolerance or a number of iterations below 0.
DescentResult Minimize(const NonsmoothCost& cost, const VectorRef& start,
                       const DescentOptions& options = {});

}  // namespace contact_flow
