// SPDX-License-Identifier: BSD-3-Clause
#include "effort_modes.h"

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "mode_selection.h"

namespace contact_flow {
namespace {

constexpr double kEffortRounding = 1e-13;
/// At most this many candidates are enumerated where the effort depends on the mode.
constexpr int kMaxEnumerated = 12;

/// The candidates as subsets: bit k of `subset` is the k-th member.
ConstraintSet Subset(const std::vector<int>& members, std::uint32_t subset) {
  ConstraintSet set;
  for (std::size_t k = 0; k < members.size(); ++k) {
    if (subset >> k & 1u) set.Insert(members[k]);
  }
  return set;
}

/// Looks for the modes that are consistent with their own effort.
class EffortModes {
 public:
  EffortModes(ContactDynamics* dynamics, const VectorRef& x, const ConstraintSet& candidates,
              const ForceTolerance& tolerance, const ConstraintSet& pressed)
      : dynamics_(*dynamics),
        x_(x),
        candidates_(candidates),
        pressed_(pressed),
        tolerance_(tolerance) {
    const MechanicalSystem& system = dynamics_.system();
    const InverseInertia inertia(system, x.head(system.num_positions()), x.tail(system.dof()));
    terms_ = inertia.terms();
    gain_ = (terms_.jacobian * (inertia * terms_.jacobian.transpose())).diagonal();
  }

  ContactMode Find() {
    if (candidates_.Size() > kMaxEnumerated) {
      throw UndecidedMode("more than " + std::to_string(kMaxEnumerated) +
                          " resting contacts with an effort that depends on the contact mode");
    }
    std::vector<int> members;
    for (int i : candidates_) members.push_back(i);
    const auto& names = dynamics_.system().description().constraints;
    int found = 0;
    ConstraintSet result;
    std::string all;
    for (std::uint32_t subset = 0; subset < (1u << members.size()); ++subset) {
      AskBudget();
      const ConstraintSet forced = Subset(members, subset);
      if (!Fits(forced)) continue;
      all += (found++ > 0 ? " and " : "") + (forced | pressed_).ToString(names);
      result = forced;
    }
    if (found == 1) return ContactMode(result | pressed_);
    throw UndecidedMode(
        "the effort depends on the contact mode, and among the contacts " +
        candidates_.ToString(names) +
        (found == 0
             ? " no mode agrees with its own effort: the motion would slide on the switching "
               "surface (Filippov), which is not a mode of this system"
             : " several modes agree with their own effort, " + all +
                   ": the motion goes on in any of them and is not unique (Filippov)"));
  }

 private:
  bool Fits(const ConstraintSet& forced) {
    const ContactMode mode(forced | pressed_);
    dynamics_.Evaluate(x_, mode);
    const Vector force = dynamics_.force();
    const Vector acceleration = terms_.jacobian * dynamics_.acceleration() + terms_.bias;
    const double rounding = kEffortRounding * (1 + force.cwiseAbs().maxCoeff());
    const double still = kEffortRounding * (1 + acceleration.cwiseAbs().maxCoeff());
    for (int i : candidates_) {
      const bool member = forced.Contains(i);
      const double rate = dynamics_.ForceRate(x_, mode.With(i), i);
      const double value = member ? force(i) : acceleration(i);
      // What a force changes by within the tolerance, as an acceleration: times G_ii.
      const double zero =
          tolerance_.Of(i, rate) * (member ? 1 : gain_(i)) + (member ? rounding : still);
      const bool fits = std::abs(value) <= zero ? (rate > 0) == member : value > 0;
      if (!fits) return false;
    }
    return true;
  }

  ContactDynamics& dynamics_;
  const Vector x_;
  const ConstraintSet candidates_;
  const ConstraintSet pressed_;
  const ForceTolerance& tolerance_;
  ConstraintTerms terms_;
  Vector gain_;  // G_ii
};

}  // namespace

ContactMode SelectByEffort(ContactDynamics* dynamics, const VectorRef& x,
                           const ConstraintSet& candidates, const ForceTolerance& tolerance,
                           const ConstraintSet& pressed) {
  return EffortModes(dynamics, x, candidates, tolerance, pressed).Find();
}

}  // namespace contact_flow
