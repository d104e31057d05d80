// SPDX-License-Identifier: BSD-3-Clause
// How a Flow keeps contacts where they are held: by accelerations alone, gaps and rates would drift
// without bound.
#include <algorithm>
#include <cmath>

#include "contact_flow/flow/flow.h"
#include "contact_flow/flow/manifold_projection.h"
#include "resolution.h"

namespace contact_flow {
namespace {

/// Gaps are put back beyond this part of the absolute tolerance, rates also beyond the second part
/// of what counts as rest at a start. In runs of some seconds nothing comes so far.
constexpr double kDrift = 0.1, kSlowDrift = 1e-2;
/// What lets go does so from its surface, not from this part of the tolerance below it.
constexpr double kDriftAtEvents = 1e-3;

}  // namespace

bool Flow::Drifts(double part) const {
  if (mode_.Empty()) return false;
  const double far = x_.head(system_.num_positions()).cwiseAbs().maxCoeff();
  const double gap = std::max(part * options_.absolute_tolerance, kUnits * far);
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

bool Flow::Drifts() const { return Drifts(kDrift); }

void Flow::PutBackAtEvent() {
  if (Drifts(kDriftAtEvents)) ProjectContacts(system_, mode_, &x_);
}

}  // namespace contact_flow
