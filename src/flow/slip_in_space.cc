// SPDX-License-Identifier: BSD-3-Clause
// How a Flow meets the end of a slip in space.
#include <algorithm>
#include <limits>

#include "contact_flow/flow/flow.h"
#include "src/dynamics/slips_in_space.h"

namespace contact_flow {
namespace {

/// Part of the time in which a slip in space would end that a step may take, and the slip that
/// counts as ended: relative to the terms of its rate, to the absolute tolerance, or by the time to
/// its end, relative to max(1, t).
constexpr double kSlipPart = 0.5, kStopped = 1e-12, kPartOfTolerance = 1e-3, kNoSlipTime = 1e-12;
/// A slip below the tolerance counts as ended where the contact sticks with this part of its cone
/// to spare: near the border it would end ever more slowly, and the steps are as short as before.
constexpr double kSpare = 1e-9;
/// A slip that is so many times as fast at the end of a step turns by another rate there.
constexpr double kOutgrown = 10;
/// In an arc as young as kYoung a slip counts as ended with less time to its end, unless the
/// contact would stick: one that has just begun may lose speed while it turns into its direction.
/// Both times are relative to max(1, t).
constexpr double kYoung = 1e-10, kNoTimeOfYoung = 1e-13;
/// Rows of slips are hardly longer than this.
constexpr double kLongSlip = 100;

/// Whether a slip at x, of the rows from `row` on, is none but for rounding of the velocities that
/// it is a sum of.
bool IsSlipRounding(const MechanicalSystem& system, const Vector& x, double slip, int row) {
  const auto v = x.tail(system.dof());
  if (!(slip <= kStopped * kLongSlip * v.lpNorm<Eigen::Infinity>())) return false;
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), v, &terms);
  const Vector sizes = terms.jacobian.middleRows<2>(row).cwiseAbs() * v.cwiseAbs();
  return slip <= kStopped * sizes.maxCoeff();
}

}  // namespace

/// The slip of a contact in space has no sign to change: steps grow shorter as it ends.
double Flow::SlipInSpaceLimit() const {
  double limit = std::numeric_limits<double>::infinity();
  for (int i : SlidingInSpace()) {
    const int row = system_.friction()[i].row;
    limit = std::min(limit, kSlipPart * gaps_begin_.rate.segment<2>(row).norm() /
                                gaps_begin_.acceleration.segment<2>(row).norm());
  }
  return limit;
}

/// Whether an implicit step leads from a slip in space that has hardly begun to one that is far
/// faster. The rate at which its direction turns, μ λ / |slip|, falls by as much meanwhile, and the
/// error that is estimated by the rate at the beginning says nothing of the end.
bool Flow::OutgrowsTurn() const {
  if (!ProposesImplicit()) return false;
  for (int i : SlidingInSpace()) {
    const int row = system_.friction()[i].row;
    const double begin = gaps_begin_.rate.segment<2>(row).norm();
    if (gaps_end_.rate.segment<2>(row).norm() > kOutgrown * begin) return true;
  }
  return false;
}

/// The guard of a contact in space whose slip has ended at the end of the step, or −1.
int Flow::StoppedInSpace() {
  for (int i : SlidingInSpace()) {
    const int row = system_.friction()[i].row;
    const Eigen::Vector2d slip = gaps_end_.rate.segment<2>(row);
    const Eigen::Vector2d change = gaps_end_.acceleration.segment<2>(row);
    if (!(slip.dot(change) < 0)) continue;
    const double late = std::max(1.0, t_);
    const bool young = end_ - (new_arc_ ? t_ : arc_begin_) < kYoung * late;
    const double loss = late * change.norm();
    const double resolved = std::max(kPartOfTolerance * options_.absolute_tolerance,
                                     (young ? kNoTimeOfYoung : kNoSlipTime) * loss);
    const bool ended =
        slip.norm() <= resolved || IsSlipRounding(system_, x_end_, slip.norm(), row) ||
        (slip.norm() <= std::max(options_.absolute_tolerance, kNoSlipTime * loss) && WouldStick(i));
    if (ended) return guards_.OfFriction(i);
  }
  return -1;
}

/// Whether contact i sticks at the end of the step, where its slip has all but ended. Two points of
/// a body share the force along their line, of which one share is told: one that holds is there, or
/// none. Of faces springs decide (SelectWord), whose share this is, if there is one that holds.
bool Flow::WouldStick(int i) {
  ContactMode word = mode_;
  word.Set(i, Letter::kStick);
  dynamics_.Evaluate(x_end_, word);
  const Vector& force = dynamics_.force();
  const ConstraintSet shared = dynamics_.shared();
  if (shared.Contains(i)) {
    const double spare = dynamics_.shared_margin();
    if (shared.Size() == 2) return spare > kSpare * force.cwiseAbs().maxCoeff();
    if (spare < 0) return false;
  }
  const Friction& friction = system_.friction()[i];
  return (1 - kSpare) * friction.coefficient * force(i) >= force.segment<2>(friction.row).norm();
}

ConstraintSet Flow::SlidingInSpace() const {
  return SlipsInSpace(system_, mode_) - system_.compliant();
}

}  // namespace contact_flow
