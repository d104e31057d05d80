// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// What a MechanicalSystem offers besides whose actuators saturate: an effort e that is kept within
/// ± its limit, and below a line that falls with its joint's speed. With r = e/limit before that,
/// or what else passes ±1 there, f is smooth where no |r| is 1. Where one passes 1 f is continuous
/// and its derivatives jump: that of the motion is the product of those before and behind (the
/// saltation matrix is the identity), whatever else passes then. Integrators end a step there.
class EffortLimits {
 public:
  virtual ~EffortLimits() = default;

  /// The names of those efforts that have a limit; NAME/speed of the speed of NAME's joint.
  virtual const std::vector<std::string>& limited_efforts() const = 0;
  /// r of each of them.
  virtual void EffortShares(const VectorRef& q, const VectorRef& v, const VectorRef& u,
                            const ContactMode& mode, Vector* share) const = 0;
};

}  // namespace contact_flow
