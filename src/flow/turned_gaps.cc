// SPDX-License-Identifier: BSD-3-Clause
#include "turned_gaps.h"

#include <algorithm>
#include <cmath>

#include "step_constants.h"

namespace contact_flow {

ConstraintSet StoppedGaps(const ConstraintSet& open, const ConstraintTerms& terms,
                          const VectorRef& v_minus, const VectorRef& v_plus) {
  ConstraintSet stopped;
  for (int i : open) {
    const auto row = terms.jacobian.row(i);
    const double least = kNoSpeed * row.cwiseAbs().dot(v_minus.cwiseAbs());
    if (row.dot(v_minus) < -least && row.dot(v_plus) >= -least) stopped.Insert(i);
  }
  return stopped;
}

void NoteTurned(const GapSample& begin, double still, ConstraintSet* stopped, double* margin) {
  for (int i : *stopped) {
    const bool stands = std::abs(begin.rate(i)) <= still;
    if (!((stands ? begin.acceleration(i) : begin.rate(i)) > 0)) continue;
    *margin = std::min(*margin, std::max(begin.gap(i), 0.0));
  }
  *stopped = ConstraintSet();
}

}  // namespace contact_flow
