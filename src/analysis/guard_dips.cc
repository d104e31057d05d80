// SPDX-License-Identifier: BSD-3-Clause
#include "guard_dips.h"

#include <algorithm>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

constexpr int kPieces = 8;        // of one step, each with at most one turn of a guard
constexpr int kBisections = 60;   // of one piece: down to rounding
constexpr double kClosed = 1e-9;  // a guard below this is zero [m] or [N]

/// A gap a_i or a force λ_i along one arc, with its rate.
class Guard {
 public:
  Guard(const MechanicalSystem& system, const Arc& arc, int i)
      : system_(system),
        arc_(arc),
        i_(i),
        sign_((arc.mode & system.compliant()).Contains(i) ? -1 : 1),
        is_force_((arc.mode - system.compliant()).Contains(i)),
        dynamics_(system, arc.u),
        x_(arc.x_begin) {}

  bool is_force() const { return is_force_; }
  double Value(double t) {
    arc_.dense.Evaluate(t, x_.data());
    if (is_force_) {
      dynamics_.Evaluate(x_, arc_.mode);
      return dynamics_.force()(i_);
    }
    system_.Constraints(x_.head(system_.num_positions()), x_.tail(system_.dof()), &terms_);
    return sign_ * terms_.gap(i_);
  }
  double Rate(double t) {
    arc_.dense.Evaluate(t, x_.data());
    if (is_force_) return dynamics_.ForceRate(x_, arc_.mode, i_);
    const Vector v = x_.tail(system_.dof());
    system_.Constraints(x_.head(system_.num_positions()), v, &terms_);
    return sign_ * terms_.jacobian.row(i_).dot(v);
  }
  /// Where the rate changes from negative to positive within (left, right).
  double Turn(double left, double right) {
    for (int k = 0; k < kBisections; ++k) {
      const double middle = left + (right - left) / 2;
      (Rate(middle) < 0 ? left : right) = middle;
    }
    return right;
  }

 private:
  const MechanicalSystem& system_;
  const Arc& arc_;
  const int i_;
  const double sign_;
  const bool is_force_;
  ContactDynamics dynamics_;
  ConstraintTerms terms_;
  Vector x_;
};

}  // namespace

std::vector<GuardDip> FindGuardDips(const MechanicalSystem& system, const Arc& arc) {
  std::vector<GuardDip> dips;
  for (int i = 0; i < system.num_constraints(); ++i) {
    Guard guard(system, arc, i);
    bool risen = true;  // false while it leaves zero, where its rate is rounding
    for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
      AskBudget();
      const double begin = arc.dense.StepBegin(step);
      const double end = std::min(begin + arc.dense.StepLength(step), arc.t_end);
      double left = begin, rate_left = guard.Rate(begin);
      if (step == 0) risen = guard.Value(begin) > kClosed;
      for (int piece = 1; piece <= kPieces; ++piece) {
        const double right = begin + (end - begin) * piece / kPieces;
        const double rate_right = guard.Rate(right);
        if (risen && rate_left < 0 && rate_right >= 0) {
          const double t = guard.Turn(left, right);
          dips.push_back({i, guard.is_force(), t, guard.Value(t)});
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
