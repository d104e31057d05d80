// SPDX-License-Identifier: BSD-3-Clause
#include "guard_dips.h"

#include "contact_flow/dynamics/guards.h"
#include "resolved_instants.h"

namespace contact_flow {
namespace {

constexpr int kBisections = 60;  // of one piece: down to rounding
/// A force is zero below this part of the largest one.
constexpr double kNoForce = 1e-9;

/// A guard along one arc.
class GuardAlong {
 public:
  GuardAlong(const MechanicalSystem& system, const Arc& arc, int guard, double gap_tolerance)
      : guards_(system),
        arc_(arc),
        guard_(guard),
        gap_tolerance_(gap_tolerance),
        dynamics_(system, arc.u),
        x_(arc.x_begin) {}

  bool is_force() const { return IsOfForces(guards_.KindOf(guard_, arc_.mode)); }
  GuardJet At(double t) {
    arc_.dense.Evaluate(t, x_.data());
    return guards_.At(guard_, &dynamics_, x_, arc_.mode);
  }
  GuardSample Sample(double t) {
    const GuardJet at = At(t);
    const double zero =
        is_force() ? kNoForce * dynamics_.force().cwiseAbs().maxCoeff() : gap_tolerance_;
    return {Vector::Constant(1, at.value), Vector::Constant(1, at.rate), Vector::Constant(1, zero)};
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
  const double gap_tolerance_;
  ContactDynamics dynamics_;
  Vector x_;
};

}  // namespace

std::vector<GuardDip> FindGuardDips(const MechanicalSystem& system, const Arc& arc,
                                    double gap_tolerance) {
  std::vector<GuardDip> dips;
  if (arc.dense.Empty()) return dips;
  for (int i = 0; i < system.num_constraints(); ++i) {
    GuardAlong guard(system, arc, i, gap_tolerance);
    const GuardSample begin = guard.Sample(arc.t_begin);
    // False while it leaves zero, where its rate is rounding.
    bool risen = begin.value(0) > begin.zero(0);
    double left = arc.t_begin, rate_left = begin.rate(0);
    for (const double right : ResolvedInstants(arc, [&](double t) { return guard.Sample(t); })) {
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
  return dips;
}

}  // namespace contact_flow
