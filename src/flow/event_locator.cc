// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/event_locator.h"

#include <algorithm>
#include <cmath>

#include "contact_flow/budget.h"
#include "guard_interpolant.h"
#include "shared_guard.h"
#include "src/dynamics/coordinate_reach.h"
#include "step_constants.h"

namespace contact_flow {
namespace {

constexpr int kAffinePieces = 2, kPieces = 4, kFreePieces = 8, kForcePieces = 2;
/// A step that needs more is shortened. A force costs a Jacobian.
constexpr int kMaxGapSamples = 4000, kMaxForceSamples = 400;
/// After a step that needed more than this part of it the next grows by this factor at most.
constexpr double kBusy = 0.2, kBusyGrowth = 1.5;
/// Rounding of a slip, relative to the velocities.
constexpr double kSlipRounding = 1e-13;
/// A contact that was held may be left so far from its surface, relative to |Da||q|.
constexpr double kHeldNoise = 1e-14;
/// A gap that has not left its floor comes back at more absolute tolerances than this, as a speed.
constexpr double kFalls = 10;
/// The rounding of a gap by |Da||q| is looked at where rows as long as this would make it matter.
constexpr double kLongRow = 100;

}  // namespace

void SampleGaps(const MechanicalSystem& system, const VectorRef& x, const VectorRef& acceleration,
                ConstraintTerms* terms, GapSample* sample) {
  const int d = system.dof();
  system.Constraints(x.head(system.num_positions()), x.tail(d), terms);
  sample->gap = terms->gap;
  sample->rate.resize(terms->gap.size());
  sample->rate.noalias() = terms->jacobian.lazyProduct(x.tail(d));
  sample->acceleration = terms->bias;
  sample->acceleration.noalias() += terms->jacobian.lazyProduct(acceleration);
}

EventLocator::EventLocator(ContactDynamics* dynamics, const SimulateOptions& options)
    : dynamics_(dynamics),
      guards_(dynamics->system()),
      floor_(options.absolute_tolerance),
      fall_(std::max(options.speed_tolerance, kFalls * options.absolute_tolerance)),
      relative_tolerance_(options.relative_tolerance),
      affine_(dynamics->system().HasAffineConstraints()),
      search_(
          guards_.size(),
          [this](double theta, const ConstraintSet& set, double* value, double* rate) {
            Sample(theta, set, value, rate);
          },
          [this](double theta, const ConstraintSet& set, double* value) {
            SampleForces(theta, set, value);
          }),
      places_(&StagePlaces::OfDop853()),
      forces_(guards_.size(), StagePlaces::kMost),
      x_(dynamics->system().state_size()),
      floors_(Vector::Constant(guards_.size(), floor_)),
      gain_(Vector::Zero(dynamics->system().num_rows())),
      looks_(Vector::Zero(dynamics->system().num_constraints())) {
  const auto* surfaces = dynamic_cast<const NarrowSurfaces*>(&dynamics->system());
  if (surfaces != nullptr && surfaces->HasNarrowSurfaces()) narrow_ = surfaces;
}

/// The guards of a set, gaps or forces, on the continuous extension, and their rates by θ.
void EventLocator::Sample(double theta, const ConstraintSet& set, double* value, double* rate) {
  const MechanicalSystem& system = dynamics_->system();
  const int d = system.dof();
  const double h = stepper_->step();
  const auto put = [&](int g, const GuardJet& at) {
    value[g] = at.value;
    rate[g] = h * at.rate;
  };
  const bool forces = !(set & pushes_).Empty();
  if (!forces && (theta == 0 || theta == 1)) {
    for (int g : set) put(g, guards_.OfMotion(g, mode_, theta == 0 ? *begin_ : *end_));
    return;
  }
  stepper_->Interpolate(theta, x_.data());
  if (forces) {
    const Vector& rates = dynamics_->ForceRates(x_, mode_);
    for (int g : set) {
      put(g, {guards_.OfForce(g, *dynamics_), guards_.RateOfForce(g, *dynamics_, rates)});
    }
    return;
  }
  if (!(set & slips_).Empty()) dynamics_->Evaluate(x_, mode_);
  ConstraintSet asked;
  for (int g : set) asked.Insert(guards_.ConstraintOf(g));
  system.ConstraintsOf(asked, x_.head(system.num_positions()), x_.tail(d), &terms_);
  for (int g : set) {
    put(g, guards_.OfMotion(g, mode_, terms_, x_.tail(d), dynamics_->acceleration()));
  }
}

/// The guards of a set of forces, without their rates: an evaluation.
void EventLocator::SampleForces(double theta, const ConstraintSet& set, double* value) {
  stepper_->Interpolate(theta, x_.data());
  dynamics_->Evaluate(x_, mode_);
  for (int g : set) value[g] = guards_.OfForce(g, *dynamics_);
}

ConstraintSet EventLocator::Low(const GapSample& begin) const {
  ConstraintSet low;
  for (int i = 0; i < dynamics_->system().num_constraints(); ++i) {
    if (std::abs(begin.gap(i)) <= floor_) low.Insert(i);
  }
  return low;
}

/// The gaps that fall below −floor behind the step, to second order.
ConstraintSet EventLocator::FallingOn(const ConstraintSet& gaps) const {
  ConstraintSet falling;
  for (int i : gaps) {
    const auto [gap, rate, bend] = guards_.OfMotion(i, mode_, *end_);
    if (!(gap < 0) || !(rate < 0)) continue;
    if (bend <= 0 || gap - rate * rate / (2 * bend) < -floor_) falling.Insert(i);
  }
  return falling;
}

/// The gaps that may vanish in the step, or set a margin.
ConstraintSet EventLocator::OpenGaps(bool free) const {
  const double h = stepper_->step();
  ConstraintSet open;
  for (int i : guards_.OfGaps(mode_) - ignored_) {
    const GuardJet first = guards_.OfMotion(i, mode_, *begin_);
    const GuardJet last = guards_.OfMotion(i, mode_, *end_);
    if (!affine_ && (free || looks_(i) > 1 || !IsFar(h, first, last))) {
      open.Insert(i);
      continue;
    }
    const GuardBound bound = QuinticBound(h, first, last);
    const bool clear = bound.lowest > bound.error && bound.lowest > floor_;
    if (!clear || (bound.dips && bound.lowest - bound.error < margins_.gap)) open.Insert(i);
  }
  return open;
}

void EventLocator::SearchGaps(const ConstraintSet& gaps, bool free, LocatedEvent* event) {
  const double h = stepper_->step();
  int pieces = affine_ ? kAffinePieces : free ? kFreePieces : kPieces;
  if (margins_.piece < h) {
    pieces = std::max(pieces, static_cast<int>(std::min(std::ceil(h / (2 * margins_.piece)), 1e6)));
  }
  if (narrow_ != nullptr) {
    for (int i : gaps) pieces = std::max(pieces, static_cast<int>(std::ceil(looks_(i))));
  }
  AskBudget();
  if (!stepper_->extended()) stepper_->Extend();
  for (int i : gaps) floors_(i) = std::max(floor_, kGapNoise * std::abs(begin_->gap(i)));
  const MechanicalSystem& system = dynamics_->system();
  const auto q = stepper_->end().head(system.num_positions());
  if (floor_ < kGapNoise * kLongRow * (1 + q.lpNorm<Eigen::Infinity>())) {
    system.ConstraintsOf(gaps, q, stepper_->end().tail(system.dof()), &terms_);
    for (int i : gaps) {
      const double noise = margins_.low.Contains(i) ? kHeldNoise : kGapNoise;
      floors_(i) =
          std::max(floors_(i), noise * ReachAlong(terms_.jacobian.row(i), system.space(), q));
    }
  }
  search_.Run({gaps, floors_.data(), true, !affine_, pieces, kMaxGapSamples, false, FallingOn(gaps),
               margins_.low, fall_ * h},
              &margins_.gap, event);
  margins_.piece = std::min(h * search_.finest(), 2 * margins_.piece);
  if (static_cast<double>(search_.samples()) > kBusy * kMaxGapSamples) {
    event->growth = std::min(event->growth, kBusyGrowth);
  }
}

void EventLocator::SearchForces(ConstraintSet members, LocatedEvent* event) {
  AskBudget();
  if (!stepper_->extended()) stepper_->Extend();
  for (int g : members) {
    if (!IsShared(g)) continue;
    members.Erase(g);
    SearchSharedMargin(
        g, floors_(g),
        [&](double theta) {
          stepper_->Interpolate(theta, x_.data());
          dynamics_->Evaluate(x_, mode_);
          return SharedMargin{theta, dynamics_->shared_margin(), dynamics_->force(),
                              dynamics_->shared_gradient()};
        },
        event);
    break;
  }
  if (members.Empty()) return;
  ConstraintSet falling;
  for (int g : members) {
    if (ForceAtBegin(g) > floors_(g)) falling.Insert(g);
  }
  search_.Run({members, floors_.data(), false, false, kForcePieces, kMaxForceSamples, true, falling,
               members},
              &margins_.force, event);
}

/// Slips are smooth functions of the motion, known with their rates at both ends.
void EventLocator::SearchSlips(const ConstraintSet& slips, LocatedEvent* event) {
  AskBudget();
  if (!stepper_->extended()) stepper_->Extend();
  // A slip that has just begun is zero to the rounding of its terms.
  const MechanicalSystem& system = dynamics_->system();
  const Vector& x = stepper_->end();
  const auto v = x.tail(system.dof());
  const bool rounds = floor_ < kSlipRounding * kLongRow * v.lpNorm<Eigen::Infinity>();
  if (rounds) system.Constraints(x.head(system.num_positions()), v, &terms_);
  for (int g : slips) {
    floors_(g) = floor_;
    if (!rounds) continue;
    const auto row = terms_.jacobian.row(system.friction()[guards_.ConstraintOf(g)].row).cwiseAbs();
    floors_(g) = std::max(floor_, kSlipRounding * row.dot(v.cwiseAbs()));
  }
  double unused = std::numeric_limits<double>::infinity();
  search_.Run({slips, floors_.data(), false, false, kAffinePieces, kMaxGapSamples, false}, &unused,
              event);
}

/// A gap that came down to its floor and turns exactly where the step begins, which is inside no
/// piece; or −1.
int EventLocator::TurnsAtBegin() const {
  for (int i : guards_.OfGaps(mode_) - ignored_ - margins_.low) {
    if (begin_->rate(i) != 0 || std::abs(begin_->gap(i)) > floor_) continue;
    if (guards_.OfMotion(i, mode_, *end_).rate > 0) return i;
  }
  return -1;
}

LocatedEvent EventLocator::Locate(Stepper* stepper, const ContactMode& mode, const GapSample& begin,
                                  const GapSample& end, bool free) {
  stepper_ = stepper;
  mode_ = mode;
  begin_ = &begin;
  end_ = &end;
  rigid_ = mode - dynamics_->system().compliant();
  pushes_ = guards_.OfForces(mode, dynamics_->shared());
  slips_ = guards_.OfSlips(mode);
  LocatedEvent event;
  if (const int turning = TurnsAtBegin(); turning >= 0) return {true, 0, turning, true};
  if (narrow_ != nullptr && !ScreenPassages(&event)) return event;
  LocatedEvent pull;
  ConstraintSet forces;
  if (!rigid_.Empty()) {
    seen_ = places_->stages;
    if (free) ProbeForces(places_->stages, places_->later + StagePlaces::kProbes);
    if (!ScreenForces(free, &forces, &pull, &event)) return event;
  }
  for (int i : margins_.low) {
    if (Guards::GapSign(i, mode) * begin.gap(i) > kTouchReach * floor_) margins_.low.Erase(i);
  }
  const ConstraintSet gaps = OpenGaps(free);
  if (!gaps.Empty()) SearchGaps(gaps, free, &event);
  if (!forces.Empty()) SearchForces(forces, &event);
  if (!slips_.Empty()) SearchSlips(slips_, &event);
  // A force was seen to pull before the event: it must have let go.
  if (pull.theta < event.theta) event = {false, kShorter, pull.constraint};
  return event;
}

}  // namespace contact_flow
