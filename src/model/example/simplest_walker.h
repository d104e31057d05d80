// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "compass_walker.h"

namespace contact_flow {
namespace example {

/// The simplest walking model (Garcia, Chatterjee, Ruina and Coleman 1998): a compass walker whose
/// legs have point masses at their feet alone, in the limit in which these vanish beside the hip's.
/// M is singular in the limit; what is published of it is approached linearly in leg_mass/hip_mass.
/// Units: the hip's mass, the legs' length, and gravity, are 1.
struct SimplestWalker : CompassWalker {
  static constexpr const char* kName = "simplest_walker";
  static constexpr const char* kSummary =
      "simplest walking model of Garcia et al.: hip and light feet, which do not slip, on a slope";

  template <class P>
  struct Parameters : CompassWalker::Parameters<P> {
    Parameters() {
      this->hip_mass = P(1.0);
      this->leg_mass = P(1e-5);
      this->leg_centre = P(1.0);
      this->gravity = P(1.0);
      this->slope = P(0.009);
      this->pitch = this->stone_right = P(0.39794);
    }
  };

  /// The long-period gait from behind a heel strike of the left foot, through the next one.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    const double angle = 0.200310900544258, rate = -0.199832473004964;
    return Step(p, angle, rate, rate * std::cos(2 * angle), 4.5);
  }
};

}  // namespace example
}  // namespace contact_flow
