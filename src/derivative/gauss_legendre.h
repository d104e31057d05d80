// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Gauss–Legendre collocation on [0, 1] with s nodes c_j and basis polynomials ℓ_j, ℓ_j(c_i) =
/// δ_ij, order 2s (Hairer, Nørsett, Wanner I, Sec. II.7).
struct GaussLegendre {
  static constexpr int kMinStages = 2;
  static constexpr int kMaxStages = 10;

  int stages;
  Vector c;          ///< nodes
  Vector b;          ///< weights ∫₀¹ ℓ_j
  Vector at_end;     ///< ℓ_j(1)
  Matrix a;          ///< a_ij = ∫₀^{c_i} ℓ_j
  Matrix twice;      ///< a², for second-order equations
  Vector twice_end;  ///< bᵀ a
  /// For ẏ = λy and z = hλ the collocation polynomial leaves at the ends of a step the defect
  /// h·δ = defect·z^{s+1}, and the step the error error·z^{2s+1}.
  double defect;  ///< s!/(2s)!
  double error;   ///< (s!)²/((2s)!(2s+1)!)

  /// A point of the step that is no node.
  struct Point {
    double at;      ///< ξ
    Vector value;   ///< ℓ_j(ξ)
    Vector once;    ///< ∫₀^ξ ℓ_j
    Vector twice;   ///< Σ_i once_i a_ij, for second-order equations
    double weight;  ///< |∏ (ξ − c_i) / ∏ c_i|, about the defect here by that at the ends
  };
  /// One between each two neighbours of the nodes, not in the middle.
  std::vector<Point> between;
  Point begin;  ///< ξ = 0

  /// The rule with that many stages.
  static const GaussLegendre& WithStages(int stages);
};

}  // namespace contact_flow
