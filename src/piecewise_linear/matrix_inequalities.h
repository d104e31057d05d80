// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// S(y) = constant + Σ y_k slopes_k, symmetric, that is to be positive definite.
struct AffineMatrix {
  Matrix constant;             ///< [s×s]
  std::vector<Matrix> slopes;  ///< [s×s] each
};

/// The smallest ρ for which some y fulfils matrix inequalities that hold for every larger ρ, too:
///   min ρ   subject to   S_j(y; ρ) > 0 for all j.
struct RateProblem {
  std::string name;                                                   ///< in messages of budgets
  std::function<std::vector<AffineMatrix>(double rho)> inequalities;  ///< S_j(·; ρ)
  /// The ρ above which y is inside; +∞ where y is not to be trusted.
  std::function<double(const Vector& y)> rate;
  Eigen::Index damped = 0;  ///< so many unknowns, the last, may be without effect, and stay small
  double good_enough = 0;   ///< a rate that needs no further improvement
  std::function<bool()> cancelled;  ///< asked now and then; may be empty
};

/// Lowers the rate from that of `y`, by the method of centres (Boyd and El Ghaoui): y is moved to
/// the analytic centre of the inequalities, ρ to just above the rate of y. Both converge. Returns
/// the rate of the best y met, which replaces `y`.
double LowerRate(const RateProblem& problem, Vector* y);

}  // namespace contact_flow
