// SPDX-License-Identifier: BSD-3-Clause
// How a Flow keeps contacts where they are held: by accelerations alone, gaps and rates would drift
// without bound.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "contact_flow/flow/flow.h"
#include "resolution.h"
#include "step_constants.h"

namespace contact_flow {

/// What rates of what is held may drift to [m/s].
double Flow::SlowDrift() const {
  return std::max(kDrift * options_.absolute_tolerance, kSlowDrift * options_.speed_tolerance);
}

/// Whether contacts have left their surfaces by more than they may at x.
bool Flow::Drifts(const Vector& x, const GapSample& sample) const {
  if (mode_.Empty()) return false;
  const double far = x.head(system_.num_positions()).cwiseAbs().maxCoeff();
  const double gap = std::max(kDrift * options_.absolute_tolerance, kUnits * far);
  const double rate = SlowDrift();
  for (int i : mode_ - system_.compliant()) {
    if (std::abs(sample.gap(i)) > gap || std::abs(sample.rate(i)) > rate) return true;
    if (!system_.HasFriction() || mode_.LetterOf(i) != Letter::kStick) continue;
    const Friction& friction = system_.friction()[i];
    const auto slip = sample.rate.segment(friction.row, friction.dimension);
    if (slip.lpNorm<Eigen::Infinity>() > rate) return true;
  }
  return false;
}

bool Flow::Penetrates() {
  const double depth =
      std::max(kDeep * options_.gap_tolerance, kUnresolved * options_.absolute_tolerance);
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (!(gaps_begin_.gap(i) < -depth) || mode_.Contains(i)) continue;
    if (system_.compliant().Contains(i) || implied_.constraints().Contains(i)) continue;
    std::ostringstream reason;
    reason << "constraint '" << system_.description().constraints[i] << "' is penetrated by "
           << -gaps_begin_.gap(i) << ": its touchdowns follow each other too quickly to be located";
    Stop(Outcome::kChatter, reason.str());
    return true;
  }
  return false;
}

}  // namespace contact_flow
