// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/types.h"

namespace contact_flow {

/// The places in a step, θ ∈ [0, 1], at which guards that are functions of forces are known, in
/// this order: those of the stages, in which the end is one; those that are looked at where a guard
/// is not excluded by the first; and the probes of free steps. Irregular, so that a guard of many
/// periods in the step does not look smooth at all of them.
struct StagePlaces {
  static constexpr int kMost = 16, kNodes = 6, kChecks = 4, kProbes = 2;

  int stages;     ///< known after a step
  int end;        ///< which of these is θ = 1
  int later;      ///< … and those looked at when asked, behind them
  bool extended;  ///< whether probes are looked at on the step's extension, which costs nothing
  std::array<double, kMost> at;  ///< of all, stages + later + kProbes of them
  /// A quintic goes through the nodes, in the order of θ; checks and probes are held against it.
  std::array<int, kNodes> nodes;
  std::array<int, kChecks> checks;
  double reach;  ///< the error of a smooth guard, in misses at the checks
  Eigen::Matrix<double, kNodes, kNodes> bernstein;  ///< coefficients from the values at the nodes
  Eigen::Matrix<double, kChecks + kProbes, kNodes> check;  ///< values at checks and probes

  int first_probe() const { return stages + later; }

  static const StagePlaces& OfDop853();
  /// Of Radau IIA with 3 or 5 stages.
  static const StagePlaces& OfRadau(int stages);
};

}  // namespace contact_flow
