// SPDX-License-Identifier: BSD-3-Clause
#include "guard_zeros.h"

#include <algorithm>
#include <cmath>

#include "resolution.h"
#include "src/dynamics/coordinate_reach.h"

namespace contact_flow {
namespace {

/// A slope below this part of its terms is none.
constexpr double kNoSlope = 1e-6;

}  // namespace

GuardZeros::GuardZeros(ContactDynamics* dynamics, double t, const Vector& x,
                       const ContactMode& mode, int trigger, const TransitionRules& rules)
    : n_(dynamics->system().num_constraints()),
      d_(dynamics->system().dof()),
      t_(t),
      mode_(mode),
      closed_(rules.closed),
      tolerance_(rules.reach_tolerance),
      gradients_(dynamics, x, mode, trigger) {
  const MechanicalSystem& system = dynamics->system();
  const int d = system.dof(), nq = system.num_positions();
  const Vector far = CoordinateReach(system.space(), x.head(nq));
  error_ = Vector::Zero(2 * d);
  rounding_ = kUnits * far;
  if (rules.state_error.size() > 0) {
    error_ = rules.state_error;
    error_.head(d) += rounding_;
  }
  reach_.resize(2 * d);
  reach_ << rules.relative_tolerance * far, rules.relative_tolerance * x.tail(d).cwiseAbs();
  reach_.array() += rules.absolute_tolerance;
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  acceleration_ = (terms.jacobian * gradients_.field().segment(d, d) + terms.bias).head(n_);
}

bool GuardZeros::IsOpenGap(int guard) const { return guard < n_ && !mode_.Contains(guard); }

/// What errors of the state leave of a guard with gradients of this size [2d+k]. The gap of what
/// has risen by less than the tolerance, ä t²/8, is that of its rate alone; in longer flights steps
/// add errors of their own.
double GuardZeros::KnownTo(int guard, const Eigen::RowVectorXd& terms) const {
  const double known = terms.head(2 * d_).dot(error_);
  if (closed_ == nullptr || !IsOpenGap(guard)) return known;
  const double since = closed_->Since(guard, t_);
  const bool low = std::abs(acceleration_(guard)) * since * since <= 8 * tolerance_;
  if (!low) return known;
  const double of_rate = terms.head(d_).dot(error_.tail(d_));
  const double rounding = terms.head(d_).dot(rounding_);
  return std::min(known, rounding + closed_->Error(guard, t_, of_rate));
}

GuardZero GuardZeros::At(int guard) const {
  const GuardGradients::Value at = gradients_.At(guard);
  const Eigen::RowVectorXd terms = at.gradient.cwiseAbs();
  const double known = KnownTo(guard, terms), slope = at.gradient.dot(gradients_.field());
  double error = known / std::abs(slope);
  if (IsOpenGap(guard)) {
    error = std::min(error, std::sqrt(2 * known / std::abs(acceleration_(guard))));
  } else if (!(std::abs(slope) > kNoSlope * terms.dot(gradients_.field().cwiseAbs()))) {
    error = 0;
  }
  if (!std::isfinite(error)) error = 0;
  const double reach = kAccumulated * terms.dot(reach_);
  const double beyond = forces().Contains(guard) ? reach : kHitAbove / kAccumulated * reach;
  return {at.value, slope, error, kInstantErrors * std::min(known, reach) + beyond};
}

}  // namespace contact_flow
