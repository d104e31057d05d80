// SPDX-License-Identifier: BSD-3-Clause
// How a Flow keeps contacts where they are held: by accelerations alone, gaps and rates would drift
// without bound.
#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>

#include "contact_flow/flow/flow.h"
#include "resolution.h"
#include "src/dynamics/coordinate_reach.h"
#include "step_constants.h"

namespace contact_flow {

/// What rates of what is held may drift to [m/s].
double Flow::SlowDrift() const {
  return std::max(kDrift * options_.absolute_tolerance, kSlowDrift * options_.speed_tolerance);
}

namespace {

/// How large the terms of gap i are at x, as far as they may round.
double GapReach(const MechanicalSystem& system, int i, const Vector& x) {
  ConstraintTerms terms;
  const auto q = x.head(system.num_positions());
  system.ConstraintsOf(ConstraintSet{i}, q, x.tail(system.dof()), &terms);
  return ReachAlong(terms.jacobian.row(i), system.space(), q);
}

}  // namespace

/// Whether contacts have left their surfaces by more than they may at x.
bool Flow::Drifts(const Vector& x, const GapSample& sample) const {
  if (mode_.Empty()) return false;
  const double gap = kDrift * options_.absolute_tolerance, rate = SlowDrift();
  for (int i : mode_ - system_.compliant()) {
    if (std::abs(sample.rate(i)) > rate) return true;
    const double left = std::abs(sample.gap(i));
    if (left > gap && left > kUnits * GapReach(system_, i, x)) return true;
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
