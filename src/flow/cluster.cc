// SPDX-License-Identifier: BSD-3-Clause
// Which guards vanish together with the one that was located.
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "resolution.h"
#include "src/dynamics/coordinate_reach.h"

namespace contact_flow {
namespace {

/// First and last of a set of times.
class Spread {
 public:
  void Add(double t) {
    first_ = std::min(first_, t);
    last_ = std::max(last_, t);
  }
  double Length() const { return last_ > first_ ? last_ - first_ : 0; }

 private:
  double first_ = std::numeric_limits<double>::infinity();
  double last_ = -std::numeric_limits<double>::infinity();
};

}  // namespace

/// |Dg_i| e for every guard, and its rounding; to be called when the forces were differentiated.
void Resolution::FindGuardErrors(const VectorRef& q) {
  const int n = system_.num_constraints();
  guard_error_.setZero(n);
  guard_reach_.resize(n);
  far_ = CoordinateReach(system_.space(), q);
  const auto speeds = transition().x_minus.tail(d_).cwiseAbs();
  Vector change(2 * d_);
  const auto along = [&](int i) {
    return IsMember(i) ? dynamics_.force_jacobian().row(i).head(2 * d_).cwiseAbs().dot(change)
                       : terms_.jacobian.row(i).cwiseAbs().dot(change.head(d_));
  };
  if (rules_.state_error.size() > 0) {
    change = rules_.state_error;
    change.head(d_) += kUnits * far_;
    change.tail(d_) += kUnits * speeds;
    for (int i = 0; i < n; ++i) guard_error_(i) = along(i);
  }
  change.head(d_) = rules_.relative_tolerance * far_;
  change.tail(d_) = rules_.relative_tolerance * speeds;
  change.array() += rules_.absolute_tolerance;
  for (int i = 0; i < n; ++i) guard_reach_(i) = kAccumulated * along(i);
}

/// The trigger is touched, or would let go, with vanishing slope.
void Resolution::Touch(int i, double slope) {
  transition().grazed.Insert(i);
  std::ostringstream message;
  message << "constraint '" << Name(i) << "' " << (IsMember(i) ? "lets go" : "is touched")
          << " at t = " << transition().t << " s with "
          << (IsMember(i) ? "dλ/dt = " : "normal velocity ") << slope
          << (IsMember(i) ? " N/s" : " m/s") << ": grazing, not admissible";
  Warn(Outcome::kGrazing, message.str());
  transition().obstacle = {Outcome::kGrazing, message.str()};
  if (compliant_.Contains(i)) {
    // On the side to which its gap accelerates.
    const bool inside = acceleration_(i) < 0;
    if (inside != transition().mode_before.Contains(i)) transition().switched.Insert(i);
    return;
  }
  if (IsMember(i)) {
    if (rules_.stalled) transition().vanishing.Insert(i);
    return;
  }
  result_.approach_speed = 0;
  if (slope <= 0) return;
  // It rises and is pressed back at once: so are others that do the same.
  for (int j = 0; j < system_.num_constraints(); ++j) {
    if (IsMember(j) || compliant_.Contains(j) || j == i) continue;
    const bool near = std::abs(terms_.gap(j)) <= kLowReaches * rules_.reach_tolerance;
    if (near && rate_(j) > 0 && rate_(j) <= Low(j)) transition().grazed.Insert(j);
  }
}

/// A gap that opens again by itself, and closes by no more than it is known to: whether it touches
/// at all is decided by errors.
void Resolution::NoteUnresolvedDip(int i, double slope) {
  const double opening = Guards::GapSign(i, transition().mode_before) * acceleration_(i);
  const double known =
      std::max(kInstantErrors * guard_error_(i), kUnknownDip * guard_reach_(i) / kAccumulated);
  if (!(opening > 0 && slope * slope <= 2 * opening * known)) return;
  std::ostringstream what;
  what << "constraint '" << Name(i) << "' is touched with normal velocity " << slope
       << " m/s, where its gap opens again within its error of " << known
       << " m: grazing, as far as it is known";
  transition().obstacle = {Outcome::kGrazing, Sentence(what.str())};
}

/// A projection would hold again what rises, however slowly.
bool Resolution::HasLetGo(int i, double rate) const {
  return rules_.impact_law == ImpactLaw::kProjection &&
         rate > Rounding(i, result_.transition.x_minus.tail(d_));
}

void Resolution::Collect(int trigger) {
  const double asked = rules_.simultaneity_tolerance;
  const double own = InstantError(trigger, GuardOf(trigger).rate);
  transition().tolerance = asked > 0 ? asked : kInstantErrors * own;
  Spread spread;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    const bool member = IsMember(i);
    const double value = GuardOf(i).value, slope = GuardOf(i).rate;
    const double slow = member ? 0 : Still(i);
    if (i == trigger && slope >= -slow) {
      Touch(i, slope);
    } else if (rules_.implied.Contains(i) && i != trigger) {
      touching_.Insert(i);
    } else if (slope < -slow && (i == trigger || FallsWith(i, value, slope, own))) {
      spread.Add(-value / slope);
      transition().instants.push_back({i, -value / slope, InstantError(i, slope)});
      (compliant_.Contains(i) ? transition().switched
       : member               ? transition().vanishing
                              : transition().activated)
          .Insert(i);
      if (!member) NoteUnresolvedDip(i, slope);
      double& margin = member ? result_.release_rate : result_.approach_speed;
      margin = std::min(margin, -slope);
    } else if (!member && !compliant_.Contains(i) && std::abs(slope) <= slow) {
      const auto row = terms_.jacobian.row(i).cwiseAbs();
      const double floor = kRounding * row.cwiseProduct(far_.transpose()).maxCoeff();
      const bool touches = std::abs(value) <= std::max(rules_.gap_tolerance, floor);
      if (touches && !HasLetGo(i, slope)) touching_.Insert(i);
    }
  }
  touching_ = touching_ - transition().grazed;
  transition().spread = spread.Length();
}

}  // namespace contact_flow
