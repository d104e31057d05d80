// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/start_stop.h"

#include "contact_flow/piecewise_linear/linear_program.h"
#include "friction_lift.h"
#include "frictional_reset.h"
#include "stopping_slips.h"

namespace contact_flow {

StartStop::StartStop(std::shared_ptr<ContactDynamics> dynamics, const VectorRef& x,
                     ContactMode mode)
    : dynamics_(std::move(dynamics)), x_(x), mode_(mode) {
  if (mode.Sticking().Empty()) return;
  rate_jacobian_ = RateJacobian(*dynamics_, x_);
  matrix_ = StopProjection(dynamics_.get(), x_, mode, mode.Sticking(), rate_jacobian_);
}

Vector StartStop::operator()(const VectorRef& w, ConstraintSet brushed) const {
  if (Empty()) return w;
  CheckStops(dynamics_.get(), x_, mode_, brushed, rate_jacobian_, w);
  return matrix_ * w;
}

Status StartStop::PiecewiseLinear() const {
  if (Empty() || NoFrictionLifts(dynamics_.get(), x_, mode_)) return {};
  if (!HaveLinearPrograms()) {
    return {Outcome::kNotPiecewiseLinear,
            "whether contacts stay closed while slips stop is told by linear programs: built "
            "without Clp"};
  }
  return {Outcome::kNotPiecewiseLinear,
          "while slips stop that a direction gives to contacts " +
              mode_.Sticking().ToString(dynamics_->system().description().constraints) +
              ", which stick at the start, a contact may be let off: the pieces are not known"};
}

}  // namespace contact_flow
