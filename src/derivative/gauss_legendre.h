// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/types.h"

namespace contact_flow {

/// Gauss–Legendre collocation on [0, 1] with kStages nodes (Hairer, Nørsett, Wanner I, Sec. II.7).
struct GaussLegendre {
  static constexpr int kStages = 6;
  using Row = Eigen::Matrix<double, kStages, 1>;
  using Square = Eigen::Matrix<double, kStages, kStages>;

  Row c;           ///< nodes
  Row b;           ///< weights ∫₀¹ ℓ_j
  Row at_begin;    ///< ℓ_j(0)
  Row at_end;      ///< ℓ_j(1)
  Square a;        ///< a_ij = ∫₀^{c_i} ℓ_j
  Square twice;    ///< a², for second-order equations
  Row twice_end;   ///< bᵀ a

  static const GaussLegendre& Get();
};

}  // namespace contact_flow
