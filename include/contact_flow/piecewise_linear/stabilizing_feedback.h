// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Settings of the search for a feedback.
struct FeedbackOptions {
  bool piecewise = false;      ///< κ may have a kink on each face of f, else it is linear
  double good_enough = 0;      ///< a rate that needs no further improvement
  StabilityOptions stability;  ///< of the certificate: margins, budgets, whether cancelled
};

/// A feedback once a step, and what is known of the loop that it closes.
struct StabilizingFeedback {
  bool certified = false;            ///< `certificate` proves that `closed` is exponentially stable
  double rate = 0;                   ///< of `closed` in the best common quadratic norm found
  PiecewiseLinearMap law;            ///< w = κ(x) [m×n], the best that was found
  PiecewiseLinearMap closed;         ///< x ↦ f(x, κ(x)) [n×n]
  StabilityCertificate certificate;  ///< for VerifyCertificate(closed, …)
  std::string message;               ///< what proves it, or why nothing does
};

/// x ↦ f(x, κ(x)) of a map f: ℝⁿ⁺ᵐ → ℝʳ and a law κ: ℝⁿ → ℝᵐ, with the pieces of both.
PiecewiseLinearMap ClosedLoop(const PiecewiseLinearMap& step, const PiecewiseLinearMap& law);

/// Seeks w = κ(x) that makes x⁺ = f(x, w) exponentially stable, f: ℝⁿ⁺ᵐ → ℝⁿ continuous and
/// piecewise linear with pieces (A_i B_i) on cones with faces (C_h D_h).
///   Linear, κ = K x: gain and norm at once, by linear matrix inequalities in Q = P⁻¹, Y = K Q,
///     [ρQ  (A_iQ + B_iY)ᵀ ; A_iQ + B_iY  ρQ] > 0   ⇔   |A_i + B_iK|_P < ρ   for all i,
///   with the smallest ρ: where that is < 1, K is found and P is its certificate. Else the largest
///   eigenvalue of all A_i + B_iK is made small by descents, from the gains for all pieces and for
///   each alone, then from around the best end. Words of pieces that can follow one another
///   (AssessStability) are the certificate, if they are one; a word by which the loop grows more
///   counts in further descents, and the gain of the smallest growth that is proven is the law.
///   Piecewise, κ = K x + Σ_h k_h max(0, −c_h x), c_h = C_h + D_h K: continuous, with a gain of its
///   own on each side of each face. For given k_h this is a linear law for the map
///   (x, v) ↦ f(x, v + Σ_h k_h max(0, −(C_h x + D_h v))), found as above. The k_h are those that
///   leave least, in P, of the jumps of (A B) across the faces; K and k_h in turn while ρ falls.
/// Each candidate is judged by its closed loop, ClosedLoop(f, κ), whose pieces and cones are made
/// anew. Not to find a law does not prove that there is none. Throws std::invalid_argument for a
/// map without inputs, and for more than 8 faces of a piecewise law.
StabilizingFeedback FindStabilizingFeedback(const PiecewiseLinearMap& step,
                                            const FeedbackOptions& options = {});

}  // namespace contact_flow
