// SPDX-License-Identifier: BSD-3-Clause
// How a Flow chooses its integrator: the explicit one, or the implicit one where forces are stiff.
#include <algorithm>
#include <utility>

#include "contact_flow/flow/flow.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

constexpr int kRadauStages = 5;
/// An implicit step of this many times 1/ρ, or less, is one that the explicit method would make as
/// well; after so many in a row it does.
constexpr double kSoft = 2;
constexpr int kSoftSteps = 3;
/// A slip in space of so many absolute tolerances, or of this part of the velocities that it is a
/// sum of, has only begun.
constexpr double kBegun = 1e3, kBegunPart = 1e-7;

}  // namespace

void Flow::FieldAt(int place, const double* x, double* xdot) {
  const int d = system_.dof(), nq = system_.num_positions();
  dynamics_.Evaluate(Eigen::Map<const Vector>(x, nq + d), mode_);
  if (!mode_.Empty()) locator_.RecordForceAt(place, dynamics_.force(), mode_);
  system_.space().Rate(x, x + nq, xdot);
  Eigen::Map<Vector>(xdot + nq, d) = dynamics_.acceleration();
}

void Flow::MakeImplicit() {
  implicit_ = std::make_unique<Radau>(
      system_.space(), kRadauStages,
      [this](int place, const double* x, double* xdot) { FieldAt(place, x, xdot); },
      [this](const Vector& x, Matrix* jacobian) {
        dynamics_.Differentiate(x, mode_);
        *jacobian = dynamics_.acceleration_jacobian().leftCols(2 * system_.dof());
      });
  stepper_ = implicit_.get();
  locator_.SetPlaces(stepper_->places());
}

/// After a step that ends at no event. The explicit method is left for stiffness where the method
/// is automatic, and comes back from a slip that has begun.
void Flow::ConsiderMethod() {
  const bool implicit = ProposesImplicit();
  if (!implicit && options_.method == IntegrationMethod::kExplicit) return;
  const bool speaks =
      implicit ? implicit_->Stiffness() < kSoft : explicit_.stiffness() > Dop853::kStable;
  if (speaks) {
    ++for_change_;
    against_change_ = 0;
  } else if (++against_change_ >= (implicit ? 1 : kOthers)) {
    for_change_ = 0;
  }
  if (for_change_ < (implicit ? kSoftSteps : kStiffSteps)) return;
  for_change_ = against_change_ = 0;
  if (implicit) {
    ChangeMethod(&explicit_);
  } else {
    if (!implicit_) MakeImplicit();
    ChangeMethod(implicit_.get());
  }
}

/// Where an arc begins with a slip in space as slow as one that has only begun, steps are implicit:
/// its direction turns to where it is pulled at a rate that falls from 1e12/s on, and the explicit
/// method, whose steps stability limits then, makes errors of some tolerances that are not told.
void Flow::MeetTurns() {
  if (ProposesImplicit()) return;
  for (int i : SlidingInSpace()) {
    const int row = system_.friction()[i].row;
    const double slip = gaps_begin_.rate.segment<2>(row).norm();
    const auto rows = terms_.jacobian.middleRows<2>(row).cwiseAbs();
    const double size = rows.lazyProduct(x_.tail(system_.dof()).cwiseAbs()).maxCoeff();
    if (slip > std::max(kBegun * options_.absolute_tolerance, kBegunPart * size)) continue;
    if (!implicit_) MakeImplicit();
    for_change_ = against_change_ = 0;
    return ChangeMethod(implicit_.get());
  }
}

/// Goes on from the node with the other integrator, and a step as long as the last one.
void Flow::ChangeMethod(Stepper* stepper) {
  stepper_ = stepper;
  locator_.SetPlaces(stepper_->places());
  stepper_->Begin(x_);
}

}  // namespace contact_flow
