// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "contact_flow/types.h"

namespace contact_flow {

/// The nodes of Radau IIA with s stages: the zeros of P_s − P_{s−1} moved to [0, 1]; the last is 1.
std::vector<long double> RadauNodes(int s);

/// The coefficients of Radau IIA with s stages (3 or 5), order 2s − 1 (Hairer & Wanner II, Sec.
/// IV.5, IV.8): collocation at the zeros c of P_s − P_{s−1}, the last of which is 1.
///
/// Of a step of length h from x₀ with stages x₀ + Z_i: the collocation polynomial u has degree s,
/// u(0) = 0, u(c_i) = Z_i; its defect at the beginning is ρ = h u'(0) − h F(x₀). The extension
///   u*(θ) = u(θ) + ρ κ(θ),   κ' = −∏(θ − c_i) / ∏(−c_i),
/// has degree s + 1, the same end, and the right slope at both ends: local errors O(h^{s+2}). Where
/// F is stiff, ρ is that of (I − h J/γ)⁻¹ times the defect.
struct RadauRule {
  static const RadauRule& WithStages(int s);

  int stages;
  Vector c;        ///< [s]
  Matrix a;        ///< the method's matrix [s×s]
  Matrix inverse;  ///< a⁻¹ [s×s]
  /// a⁻¹ = T Λ T⁻¹ with one real eigenvalue γ and (s−1)/2 pairs, of which one each is kept.
  double real_eigenvalue;
  std::vector<std::complex<double>> eigenvalues;
  Vector to_real;                           ///< row of T⁻¹ for γ [s]
  Vector from_real;                         ///< column of T for γ [s]
  std::vector<Eigen::VectorXcd> to_pair;    ///< rows of T⁻¹, one of each pair [s]
  std::vector<Eigen::VectorXcd> from_pair;  ///< columns of T, twice: the real part counts [s]
  Vector slope_at_begin;                    ///< u'(0) by Z [s]
  /// Places beside the nodes where the defect of u* is looked at, and what u* and its slope there
  /// are by Z and ρ [s+1].
  std::array<double, 2> check;
  std::array<Vector, 2> value_at_check, slope_at_check;
  /// Coefficients c₂ … c₇ of EvaluateDenseStep by Z and ρ [6 × s+1].
  Matrix dense;
};

}  // namespace contact_flow
