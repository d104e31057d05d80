// SPDX-License-Identifier: BSD-3-Clause
#include "hybrid_system.h"

#include <algorithm>
#include <stdexcept>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/flow/transition.h"

namespace contact_flow {
namespace benchmark {
namespace {

constexpr double kSimultaneous = 1e-7;  // [s]

}  // namespace

HybridSystem::HybridSystem(const Scenario& scenario)
    : system_(*scenario.system),
      dynamics_(system_, scenario.u),
      initial_mode_(InitialMode(system_, scenario.x, scenario.u)),
      x_(kStates) {
  Reset();
}

void HybridSystem::Reset() {
  mode_ = initial_mode_;
  counted_ = dynamics_.evaluations();
}

void HybridSystem::Field(const double* x, double* xdot) {
  constexpr int kDof = kStates / 2;
  dynamics_.Evaluate(Eigen::Map<const Vector>(x, kStates), mode_);
  const Vector& acceleration = dynamics_.acceleration();
  for (int i = 0; i < kDof; ++i) {
    xdot[i] = x[kDof + i];
    xdot[kDof + i] = acceleration(i);
  }
}

const Matrix& HybridSystem::AccelerationJacobian(const double* x) {
  dynamics_.Differentiate(Eigen::Map<const Vector>(x, kStates), mode_);
  return dynamics_.acceleration_jacobian();
}

void HybridSystem::Gaps(const double* x, double* gap, double* rate) {
  const Eigen::Map<const Vector> q(x, kStates / 2), v(x + kStates / 2, kStates / 2);
  system_.Constraints(q, v, &terms_);
  for (int i = 0; i < num_constraints(); ++i) {
    if (mode_.Contains(i)) {
      if (dynamics_.force()(i) < 0) throw std::logic_error("a foot is released");
      gap[i] = 1;
      rate[i] = 0;
    } else {
      gap[i] = terms_.gap(i);
      rate[i] = terms_.jacobian.row(i).dot(v);
    }
  }
}

const Transition& HybridSystem::Pass(double t, int trigger, double* x) {
  const SimulateOptions options;
  x_ = Eigen::Map<const Vector>(x, kStates);
  TransitionRules rules{};
  rules.simultaneity_tolerance = kSimultaneous;
  rules.speed_tolerance = options.speed_tolerance;
  rules.impact_law = options.impact_law;
  const ResolvedTransition resolved = ResolveTransition(&dynamics_, t, x_, mode_, trigger, rules);
  if (!resolved.status.ok()) throw std::logic_error(resolved.status.message);
  transition_ = resolved.transition;
  mode_ = transition_.mode_after;
  std::copy(transition_.x_plus.data(), transition_.x_plus.data() + kStates, x);
  return transition_;
}

}  // namespace benchmark
}  // namespace contact_flow
