// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "contact_flow/piecewise_linear/map_consistency.h"
#include "contact_flow/piecewise_linear/piecewise_linear_map.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What was decided.
enum class StabilityVerdict {
  kStable = 0,        ///< the origin is exponentially stable
  kUnstable = 1,      ///< some trajectory grows exponentially from arbitrarily near the origin
  kUndetermined = 2,  ///< nothing was proven; the bounds on growth stand
};

/// What decided, and so how its certificate reads.
enum class StabilityTest {
  kNone = 0,
  kNormOne = 1,        ///< all ‖A_i‖₁ ≤ bound < 1
  kNormTwo = 2,        ///< all ‖A_i‖₂ ≤ bound < 1
  kNormInfinity = 3,   ///< all ‖A_i‖_∞ ≤ bound < 1
  kQuadraticNorm = 4,  ///< all A_iᵀ P A_i ≤ bound² P, bound < 1, P = `norm`
  kWords = 5,  ///< every feasible word contracts ‖T y‖_∞ below `bound` < 1 at one of `words`
  kGrowingRay = 6,  ///< A_w v = λ v, λ = `bound` > 1, for a v in the cone of w
  kGrowingPlane =
      7,  ///< A_w maps a line or plane that lies within the cone of w onto itself and grows
};

/// "1-norm", …
const char* StabilityTestName(StabilityTest test);

/// The data from which a verdict can be checked again, by VerifyCertificate.
struct StabilityCertificate {
  StabilityTest test = StabilityTest::kNone;  ///< what proves it
  double bound = 0;                           ///< factor of contraction or growth
  Matrix norm;                                ///< P or T [n×n]
  std::vector<std::vector<int>>
      words;          ///< indices of pieces in the order in which they are applied
  Matrix directions;  ///< [n×1], or the plane [n×1 or n×2] of kGrowingPlane
};

/// Settings of the decision.
struct StabilityOptions {
  /// Contraction must be below 1 − margin and growth above 1 + margin, so that errors of the map in
  /// the last digits decide nothing.
  double margin = 1e-6;
  int max_word_length = 60;           ///< at most
  long max_words = 20000;             ///< examined
  long max_linear_programs = 100000;  ///< solved
  /// Whether the pieces are a map at all is checked first.
  MapConsistencyOptions consistency;
  /// Asked now and then; returning true ends the search, undetermined.
  std::function<bool()> cancelled;
};

/// What was decided, with bounds on growth.
struct StabilityReport {
  StabilityVerdict verdict = StabilityVerdict::kUndetermined;  ///< what was decided
  StabilityCertificate certificate;                            ///< its proof
  MapConsistency consistency;  ///< not usable: nothing is said of the pieces, they are not a map
  /// ‖fᵏ(y)‖ ≤ c·growth_aboveᵏ‖y‖ for every y; some y grows by growth_below per step (0: not
  /// found any).
  double growth_below = 0;
  double growth_above = 0;    ///< see growth_below
  double norm_one = 0;        ///< largest ‖A_i‖₁ over the pieces
  double norm_two = 0;        ///< largest ‖A_i‖₂
  double norm_infinity = 0;   ///< largest ‖A_i‖_∞
  double norm_quadratic = 0;  ///< in the best common quadratic norm found
  int word_length = 0;        ///< longest words examined
  long words = 0;             ///< that were looked at
  long linear_programs = 0;   ///< that were solved
  std::string message;        ///< what decided, or why nothing did
};

/// Throws std::invalid_argument, naming field and value, for a margin outside [0, 1) and for
/// budgets that allow nothing.
void CheckOptions(const StabilityOptions& options);

/// Stability of x⁺ = f(x), f square, continuous and piecewise linear with pieces A_i on cones C_i,
/// which is checked (CheckConsistency). In turn:
///   1. contraction: one norm with ‖A_i‖ < 1 for all i: 1-, 2-, ∞-norm, then a
///   common quadratic norm;
///   2. words w = i₁ i₂ … with A_w = … A_{i₂} A_{i₁} on C_w = {y : fʲ(y) ∈ C_{i_{j+1}}}, the
///   shorter ones first:
///      a word with max{‖T A_w y‖_∞ : ‖T y‖_∞ ≤ 1, y ∈ C_w} < 1 (linear programs) is done with;
///      when none is left, f is exponentially stable, T = P^{1/2} of the best quadratic norm;
///   3. on the way, instability by a real eigenvalue > 1 of some A_w with its eigenvector in C_w.
///      Dropping contracting words loses none: some rotation of a growing word grows at each of
///      its prefixes.
/// Without the linear-programming library words contract by ‖T A_w T⁻¹‖_∞ alone and none is
/// infeasible. A stable f is proven stable given enough words; an f that grows without a growing
/// word stays undetermined. Throws std::invalid_argument for options that CheckOptions refuses.
StabilityReport AssessStability(const PiecewiseLinearMap& map,
                                const StabilityOptions& options = {});

/// True when the certificate proves, from its data and the map's alone, what its test says, and the
/// pieces are one continuous map. Both may come from anywhere; words are enumerated again, in at
/// most `options`' budgets.
/// kWords needs the linear-programming library unless norms suffice.
bool VerifyCertificate(const PiecewiseLinearMap& map, const StabilityCertificate& certificate,
                       const StabilityOptions& options = {});

/// max{‖fᵏ(y)‖_∞ : ‖y‖_∞ ≤ 1} over the feasible words of length k, by linear programs. NaN when the
/// budgets do not suffice or without the library.
double WorstGain(const PiecewiseLinearMap& map, int steps, const StabilityOptions& options = {});

}  // namespace contact_flow
