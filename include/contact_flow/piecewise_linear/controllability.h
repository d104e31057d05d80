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
enum class ControllabilityVerdict {
  kControllable = 0,     ///< every y in the reachable space is attained
  kNotControllable = 1,  ///< `unattained` is not
  kUndetermined = 2,     ///< neither was proven
};

/// Settings of the decision.
struct ControllabilityOptions {
  /// Singular values below this part of the largest are zero; sets the reachable space and det = 0.
  double rank_tolerance = 1e-9;
  int max_restrictions = 200;  ///< square restrictions tried when there are more inputs than states
  int max_candidates = 200;    ///< y tried when an unattained one is sought
  /// Whether the pieces are a map at all is checked first.
  MapConsistencyOptions consistency;
  std::function<bool()> cancelled;  ///< asked now and then; may be empty
};

/// What was decided, and why.
struct ControllabilityReport {
  ControllabilityVerdict verdict = ControllabilityVerdict::kUndetermined;  ///< what was decided
  MapConsistency consistency;  ///< not usable: nothing is said of the pieces, they are not a map
  Matrix reachable;    ///< orthonormal basis of the space that the pieces span together [r×k]
  Matrix restriction;  ///< orthonormal basis of the inputs that suffice [m×k]; I when m = k
  /// Of the square map that was examined, reachableᵀ f(restriction z):
  int pieces = 0;                    ///< full-dimensional ones, thin ones included
  bool coherently_oriented = false;  ///< all their determinants have one sign
  double smallest_singular_ratio =
      0;                       ///< min over pieces of σ_min/σ_max: near 0, a sign is hardly known
  int degree = 0;              ///< Σ sign det A_i over the preimages of a generic y
  int preimages = 0;           ///< their number; with coherent orientation the same for every y
  bool homeomorphism = false;  ///< coherently oriented with one preimage
  Vector unattained;           ///< a y [r] that no input attains, if found
  std::vector<Vector> twins;   ///< two inputs [m] with one value, if found: not injective
  std::string message;         ///< why, as a sentence
};

/// Orthonormal basis [r×k] of the span of all the pieces' images; I when k = r. Otherwise its
/// orientation, and with it the sign of a degree, is a matter of chance.
Matrix ReachableBasis(const PiecewiseLinearMap& map, double rank_tolerance = 1e-9);

/// Inputs w with f(w) = y (the direction of y alone matters), one for each full-dimensional piece
/// that has one; of a square map. `clear` is false when one lies so near a face that the count is
/// not to be trusted.
std::vector<Vector> Preimages(const PiecewiseLinearMap& map, const VectorRef& y, bool* clear);

/// Is the piecewise-linear map f: ℝᵐ → ℝʳ from inputs to states onto its reachable space ℝᵏ? To
/// first order every state nearby is then reached. That the pieces are one continuous map is
/// checked (CheckConsistency). For m = k
///   f is open iff it is coherently oriented, det A_i of one sign over all full-dimensional pieces
///   (Scholtes), onto if Σ sign det A_i ≠ 0 over the preimages of a generic y (its degree), a
///   homeomorphism iff it is coherently oriented and one generic y has exactly one preimage.
/// For m > k square restrictions to k-dimensional subspaces of inputs are tried. For m < k it is
/// never onto.
ControllabilityReport AssessControllability(const PiecewiseLinearMap& map,
                                            const ControllabilityOptions& options = {});

}  // namespace contact_flow
