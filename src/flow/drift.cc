// SPDX-License-Identifier: BSD-3-Clause
// How a Flow keeps contacts where they are held: by accelerations alone, gaps and rates would drift
// without bound.
#include <algorithm>
#include <cmath>

#include "contact_flow/flow/flow.h"
#include "resolution.h"
#include "step_constants.h"

namespace contact_flow {

bool Flow::Drifts() const {
  if (mode_.Empty()) return false;
  const double far = x_.head(system_.num_positions()).cwiseAbs().maxCoeff();
  const double gap = std::max(kDrift * options_.absolute_tolerance, kUnits * far);
  const double rate =
      std::max(kDrift * options_.absolute_tolerance, kSlowDrift * options_.speed_tolerance);
  for (int i : mode_ - system_.compliant()) {
    if (std::abs(gaps_begin_.gap(i)) > gap || std::abs(gaps_begin_.rate(i)) > rate) return true;
    if (!system_.HasFriction() || mode_.LetterOf(i) != Letter::kStick) continue;
    const Friction& friction = system_.friction()[i];
    const auto slip = gaps_begin_.rate.segment(friction.row, friction.dimension);
    if (slip.lpNorm<Eigen::Infinity>() > rate) return true;
  }
  return false;
}

}  // namespace contact_flow
