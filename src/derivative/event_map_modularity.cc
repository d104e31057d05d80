// SPDX-License-Identifier: BSD-3-Clause
// How far the selections of a cluster are from one another.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include "contact_flow/derivative/event_map.h"
#include "frictional_event.h"

namespace contact_flow {

Modularity EventMap::AssessModularity() const {
  const int m = num_activations();
  Modularity modularity;
  if (!PiecewiseLinear().ok()) {
    modularity.defect = std::numeric_limits<double>::quiet_NaN();
    return modularity;
  }
  if (friction_) {
    modularity.defect = friction_->Kink();
    return modularity;
  }
  if (m < 2) return modularity;
  // F̂_S over subsets S of {0, …, m−1}: F_S carried through the resets of the activations not in S.
  const std::uint64_t all = (std::uint64_t{1} << m) - 1;
  const auto set_of = [&](std::uint64_t subset) {
    ConstraintSet S;
    for (int k = 0; k < m; ++k) {
      if (subset >> k & 1) S.Insert(activated_[k]);
    }
    return S;
  };
  // A change of the input comes after the one before it.
  const auto happens = [&](std::uint64_t subset) {
    const ConstraintSet S = set_of(subset);
    for (int i : S) {
      if (IsInputChange(i) && i > system_->num_constraints() && !S.Contains(i - 1)) return false;
    }
    return true;
  };
  const ImpactReset* reset = nullptr;
  for (std::uint64_t subset = 1; subset <= all; ++subset) {  // make every stage
    if (!happens(subset)) continue;
    const int top = 63 - __builtin_clzll(subset);
    Activate(set_of(subset & ~(std::uint64_t{1} << top)), activated_[top], &reset);
  }
  std::vector<Vector> carried(all + 1);
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    if (!happens(subset)) continue;
    ConstraintSet S = set_of(subset);
    carried[subset] = StageAt(S).field;
    for (int i : events_ - S) {
      Activate(S, i, &reset);
      carried[subset] = *reset * carried[subset];
      S.Insert(i);
    }
    modularity.scale = std::max(modularity.scale, carried[subset].cwiseAbs().maxCoeff());
  }
  for (std::uint64_t subset = 0; subset <= all; ++subset) {
    for (int i = 0; i < m; ++i) {
      for (int j = 0; j < i; ++j) {
        const std::uint64_t bi = std::uint64_t{1} << i, bj = std::uint64_t{1} << j;
        if (subset & (bi | bj)) continue;
        if (!happens(subset | bi) || !happens(subset | bj)) continue;
        const Vector defect = carried[subset | bi | bj] - carried[subset | bi] -
                              carried[subset | bj] + carried[subset];
        modularity.defect = std::max(modularity.defect, defect.cwiseAbs().maxCoeff());
      }
    }
  }
  return modularity;
}

}  // namespace contact_flow
