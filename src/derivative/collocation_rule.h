// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// Collocation on [0, 1] with s nodes c_j and basis polynomials ℓ_j, ℓ_j(c_i) = δ_ij: the rules of
/// Gauss and Legendre, order 2s (Hairer, Nørsett, Wanner I, Sec. II.7), and Radau IIA, order
/// 2s − 1, with a node at the end, under which decays that are fast beside the step are gone behind
/// it (Hairer & Wanner II, Sec. IV.5).
struct CollocationRule {
  static constexpr int kMinStages = 2;
  static constexpr int kMaxStages = 10;

  int stages;
  bool stiff;        ///< Radau IIA
  Vector c;          ///< nodes
  Vector b;          ///< weights ∫₀¹ ℓ_j
  Vector at_end;     ///< ℓ_j(1)
  Matrix a;          ///< a_ij = ∫₀^{c_i} ℓ_j
  Matrix twice;      ///< a², for second-order equations
  Vector twice_end;  ///< bᵀ a
  /// For ẏ = λy and z = hλ the collocation polynomial leaves at the beginning of a step the defect
  /// h·δ = defect·z^{s+1}, and the step the error error·z^power. That of Gauss and Legendre leaves
  /// the same at the end, that of Radau nothing.
  double defect;  ///< ∏ c_j / s!
  double error;   ///< s! l!/((s+l)!(s+l+1)!), l = s or s − 1
  int power;      ///< s + l + 1

  /// A point of the step that is no node.
  struct Point {
    double at;      ///< ξ
    Vector value;   ///< ℓ_j(ξ)
    Vector once;    ///< ∫₀^ξ ℓ_j
    Vector twice;   ///< Σ_i once_i a_ij, for second-order equations
    double weight;  ///< |∏ (ξ − c_i) / ∏ c_i|, about the defect here by that at the beginning
  };
  /// One between each two neighbours of the nodes, not in the middle.
  std::vector<Point> between;
  Point begin;  ///< ξ = 0

  /// The rules with that many stages.
  static const CollocationRule& GaussLegendre(int stages);
  static const CollocationRule& RadauIIA(int stages);
};

}  // namespace contact_flow
