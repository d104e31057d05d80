// SPDX-License-Identifier: BSD-3-Clause
#include "guard_dips.h"

#include <algorithm>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/guards.h"

namespace contact_flow {
namespace {

constexpr int kPieces = 8;        // of one step, each with at most one turn of a guard
constexpr int kBisections = 60;   // of one piece: down to rounding
constexpr double kClosed = 1e-9;  // a guard below this is zero [m] or [N]

/// A guard along one arc.
class GuardAlong {
 public:
  GuardAlong(const MechanicalSystem& system, const Arc& arc, int guard)
      : guards_(system), arc_(arc), guard_(guard), dynamics_(system, arc.u), x_(arc.x_begin) {}

  bool is_force() const { return IsOfForces(guards_.KindOf(guard_, arc_.mode)); }
  GuardJet At(double t) {
    arc_.dense.Evaluate(t, x_.data());
    return guards_.At(guard_, &dynamics_, x_, arc_.mode);
  }
  /// Where the rate changes from negative to positive within (left, right).
  double Turn(double left, double right) {
    for (int k = 0; k < kBisections; ++k) {
      const double middle = left + (right - left) / 2;
      (At(middle).rate < 0 ? left : right) = middle;
    }
    return right;
  }

 private:
  const Guards guards_;
  const Arc& arc_;
  const int guard_;
  ContactDynamics dynamics_;
  Vector x_;
};

}  // namespace

std::vector<GuardDip> FindGuardDips(const MechanicalSystem& system, const Arc& arc) {
  std::vector<GuardDip> dips;
  for (int i = 0; i < system.num_constraints(); ++i) {
    GuardAlong guard(system, arc, i);
    bool risen = true;  // false while it leaves zero, where its rate is rounding
    for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
      AskBudget();
      const double begin = arc.dense.StepBegin(step);
      const double end = std::min(begin + arc.dense.StepLength(step), arc.t_end);
      double left = begin, rate_left = guard.At(begin).rate;
      if (step == 0) risen = guard.At(begin).value > kClosed;
      for (int piece = 1; piece <= kPieces; ++piece) {
        const double right = begin + (end - begin) * piece / kPieces;
        const double rate_right = guard.At(right).rate;
        if (risen && rate_left < 0 && rate_right >= 0) {
          const double t = guard.Turn(left, right);
          dips.push_back({i, guard.is_force(), t, guard.At(t).value});
        }
        risen = risen || rate_right > 0;
        left = right;
        rate_left = rate_right;
      }
    }
  }
  return dips;
}

}  // namespace contact_flow
