// SPDX-License-Identifier: BSD-3-Clause
#include "watched_guards.h"

#include "src/dynamics/guard_gradients.h"

namespace contact_flow {

using Limit = ValidityRadius::Limit;

namespace {

Limit LimitOf(GuardKind kind) {
  switch (kind) {
    case GuardKind::kGap:
      return Limit::kGap;
    case GuardKind::kForce:
      return Limit::kForce;
    case GuardKind::kCone:
      return Limit::kCone;
    case GuardKind::kSlip:
      return Limit::kSlip;
  }
  return Limit::kNone;
}

}  // namespace

WatchedGuards::WatchedGuards(ContactDynamics* dynamics, const VectorRef& x, ContactMode mode)
    : dynamics_(*dynamics), system_(dynamics->system()), mode_(mode), numbers_(system_) {
  dynamics->Evaluate(x, mode);
  const auto watch = [&](int guard) {
    guards_.push_back({guard, numbers_.ConstraintOf(guard),
                       LimitOf(numbers_.KindOf(guard, mode, dynamics->shared()))});
  };
  for (int guard : numbers_.OfGaps(mode)) watch(guard);
  for (int guard : numbers_.OfForces(mode, dynamics->shared())) watch(guard);
  const ContactMode pressing = mode.Without(system_.compliant());
  for (int i : pressing - pressing.Sticking()) {
    const Friction& friction = system_.friction()[i];
    const bool turns = friction.dimension == 2 && friction.coefficient > 0;
    if (turns || mode.SlippingInPlane().Contains(i)) watch(numbers_.OfFriction(i));
  }
}

WatchedGuards::Values WatchedGuards::At(const VectorRef& x) const {
  const GuardGradients gradients(&dynamics_, x, mode_);
  const auto size = static_cast<Eigen::Index>(guards_.size());
  Values at;
  at.value.resize(size);
  at.gradient.resize(size, 2 * system_.dof() + dynamics_.num_variables());
  for (Eigen::Index k = 0; k < size; ++k) {
    const GuardGradients::Value guard = gradients.At(guards_[static_cast<std::size_t>(k)].number);
    at.value(k) = guard.value;
    at.gradient.row(k) = guard.gradient;
  }
  at.field = gradients.field();
  if (dynamics_.force().size() > 0) at.force = dynamics_.force().cwiseAbs().maxCoeff();
  at.rate = at.gradient * at.field;
  return at;
}

}  // namespace contact_flow
