// SPDX-License-Identifier: BSD-3-Clause
#pragma once

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
  Vector at_begin;   ///< ℓ_j(0)
  Vector at_end;     ///< ℓ_j(1)
  Matrix a;          ///< a_ij = ∫₀^{c_i} ℓ_j
  Matrix twice;      ///< a², for second-order equations
  Vector twice_end;  ///< bᵀ a
  /// For ẏ = λy and z = hλ the collocation polynomial leaves at the ends of a step the defect
  /// h·δ = defect·z^{s+1}, and the step the error error·z^{2s+1}.
  double defect;  ///< s!/(2s)!
  double error;   ///< (s!)²/((2s)!(2s+1)!)

  /// The rule with that many stages.
  static const GaussLegendre& WithStages(int stages);
};

}  // namespace contact_flow
