// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/stopped_gaps.h"

#include <algorithm>
#include <cmath>

namespace contact_flow {

void StoppedGaps::Impact(const ConstraintSet& open, const ConstraintTerms& terms,
                         const VectorRef& v_minus, const VectorRef& v_plus) {
  stopped_ = stopped_ & open;
  at_.conservativeResize(terms.gap.size());
  for (int i : open - stopped_) {
    const auto row = terms.jacobian.row(i);
    if (!(row.dot(v_minus) < -still_) || row.dot(v_plus) < -still_) continue;
    stopped_.Insert(i);
    at_(i) = terms.gap(i);
  }
}

void StoppedGaps::Judge(const GapSample& at, double* margin) {
  for (int i : stopped_) {
    const bool moves = std::abs(at.rate(i)) > still_;
    const double way = moves ? at.rate(i) : at.acceleration(i);
    if (!moves && std::abs(way) <= weak_) continue;
    if (way > 0) *margin = std::min(*margin, std::max(at_(i), 0.0));
    stopped_.Erase(i);
  }
}

}  // namespace contact_flow
