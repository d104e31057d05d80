// SPDX-License-Identifier: BSD-3-Clause
#include "walk_guards.h"

#include <cmath>

#include "contact_flow/dynamics/guards.h"

namespace contact_flow {
namespace {

/// A guard vanishes at more than this, relative: a word that holds may miss as much.
constexpr double kGuardBorder = 1e-9;

}  // namespace

std::vector<WalkGuard> GuardsAhead(ContactDynamics* dynamics, const WalkPoint& point,
                                   ContactMode mode, const ContactsAhead& ahead) {
  using Kind = WalkGuard::Kind;
  const MechanicalSystem& system = dynamics->system();
  const Vector field = dynamics->Field(point.x(), mode);
  std::vector<WalkGuard> guards;
  for (int i : ahead.landing) {
    guards.push_back({Kind::kTouchdown, i, point.gap_jacobian().row(i), point.rate()(i)});
  }
  for (int i : ahead.stopping) {
    const double sign = SlipSign(mode.LetterOf(i));
    const Eigen::RowVectorXd slip = sign * point.rate_jacobian().row(system.friction()[i].row);
    const double rate = slip.dot(field);
    if (rate < -kGuardBorder * point.acceleration()) guards.push_back({Kind::kStop, i, slip, rate});
  }
  const bool jumps = !ahead.landing.Empty() || !NeverSlipping(system, ahead.releasing).Empty();
  const bool follows = jumps && !ahead.releasing.Empty();
  if (!follows && ahead.bursting.Empty()) return guards;
  const auto add = [&](Kind kind, int i, const Eigen::RowVectorXd& gradient) {
    const double rate = gradient.dot(field);
    if (rate < -kGuardBorder * gradient.norm() * field.norm()) {
      guards.push_back({kind, i, gradient, rate});
    }
  };
  for (int i : point.AtCone(mode)) {
    if (follows || ahead.bursting.Contains(i)) add(Kind::kOnset, i, point.ConeGradient(mode, i));
  }
  for (int i : follows ? ahead.releasing& mode : ConstraintSet()) {
    dynamics->Differentiate(point.x(), mode);
    add(Kind::kRelease, i, dynamics->force_jacobian().row(i));
  }
  return guards;
}

ConstraintSet NeverSlipping(const MechanicalSystem& system, ConstraintSet contacts) {
  ConstraintSet never;
  for (int i : contacts) {
    if (std::isinf(system.friction()[i].coefficient)) never.Insert(i);
  }
  return never;
}

}  // namespace contact_flow
