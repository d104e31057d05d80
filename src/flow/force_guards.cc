// SPDX-License-Identifier: BSD-3-Clause
// How an EventLocator looks at forces: at the places of a step where they are known.
#include <algorithm>
#include <cmath>

#include "contact_flow/fixed_size.h"
#include "contact_flow/flow/event_locator.h"
#include "guard_interpolant.h"
#include "step_constants.h"

namespace contact_flow {
/// A guard that is a function of forces, where the dynamics were evaluated last; of shared ones a
/// lower bound that needs no search.
double EventLocator::AtHand(int guard) const {
  return IsShared(guard) ? dynamics_->shared_slack() : guards_.OfForce(guard, *dynamics_);
}

bool EventLocator::IsShared(int guard) const {
  return !guards_.IsNormal(guard) && dynamics_->shared().Contains(guards_.ConstraintOf(guard));
}

void EventLocator::SetPlaces(const StagePlaces& places) {
  places_ = &places;
  calls_ = 0;
}

void EventLocator::RecordForce(const Vector& force, const ContactMode& mode) {
  if (calls_ == places_->stages) return;
  StoreForce(calls_, force, mode);
  ++calls_;
}

void EventLocator::RecordForceAt(int place, const Vector& force, const ContactMode& mode) {
  StoreForce(place, force, mode);
  calls_ = place == places_->end ? places_->stages : std::max(calls_, 1);
}

void EventLocator::StoreForce(int column, const Vector& force, const ContactMode& mode) {
  const Eigen::Index n = dynamics_->system().num_constraints();
  double* out = &forces_(0, column);
  WithFixedSize(static_cast<int>(n), [&](auto few) {
    for (int i = 0; i < few; ++i) out[i] = force(i);
  });
  if (forces_.rows() == n) return;
  for (int g : guards_.OfForces(mode, dynamics_->shared())) forces_(g, column) = AtHand(g);
}

void EventLocator::EndStep() {
  std::swap(passages_begin_, passages_end_);
  knows_begin_ = knows_end_;
  if (calls_ == 0) return;
  forces_.col(0) = forces_.col(std::min(calls_ - 1, places_->end));
  calls_ = 1;
}

/// Of forces that are shared a lower bound is known: it tells where it hardly changes.
void EventLocator::PassForces(ForceMinima* minima) const {
  if (calls_ != places_->stages) return;
  for (int g : pushes_) {
    ForceMinima::Values values;
    for (std::size_t k = 0; k < values.size(); ++k) values[k] = forces_(g, places_->nodes[k]);
    if (IsShared(g)) {
      const auto [lowest, highest] = std::minmax_element(values.begin(), values.end());
      if (!(*lowest > kForceReserve * (*highest - *lowest))) continue;
    }
    minima->Pass(g, *places_, values, relative_tolerance_);
  }
}

/// What the integrator cannot resolve of each force.
void EventLocator::FindForceFloors() {
  dynamics_->InverseMasses(&gain_);
  double largest = 0;
  for (int i : rigid_) {
    const auto values = forces_.row(i).head(seen_);
    largest = std::max(largest, values.cwiseAbs().maxCoeff() * std::sqrt(gain_(i)));
  }
  const double h = stepper_->step();
  const auto rounding = [&](double gain) {
    return relative_tolerance_ * largest / std::sqrt(gain);
  };
  const auto quiet = [&](double gain) { return kQuietPull * 2 * floor_ / (gain * h * h); };
  for (int g : pushes_) {
    const int i = guards_.ConstraintOf(g);
    const Friction& friction = dynamics_->system().friction()[i];
    if (guards_.IsNormal(g) || !std::isfinite(friction.coefficient)) {
      floors_(g) = rounding(gain_(i)) + quiet(gain_(i));
      continue;
    }
    // A cone is a sum of λ_n times μ and of λ_t; what is beyond it moves the slip. The guard of
    // forces that are shared may be that of a contact without friction.
    double tangential = 0;
    if (friction.dimension > 0) {
      tangential = gain_.segment(friction.row, friction.dimension).minCoeff();
    }
    if (!(tangential > 0)) tangential = gain_(i);
    floors_(g) =
        friction.coefficient * rounding(gain_(i)) + rounding(tangential) + quiet(tangential);
  }
}

/// Adds the forces to `open` that may vanish in the step, or set a margin; `pull` becomes the first
/// place where one was seen to pull. False, with the guard in `event`, when the step does not
/// resolve one of them.
bool EventLocator::ScreenForces(bool probed, ConstraintSet* open, LocatedEvent* pull,
                                LocatedEvent* event) {
  const int all = places_->first_probe();
  bool floors = false;
  for (int i : pushes_) {
    double lowest = forces_.row(i).head(seen_).minCoeff();
    double range = forces_.row(i).head(seen_).maxCoeff() - lowest;
    if (seen_ < all && !(lowest > kForceReserve * range)) {
      ProbeForces(places_->stages, places_->later);
      lowest = forces_.row(i).head(seen_).minCoeff();
      range = forces_.row(i).head(seen_).maxCoeff() - lowest;
    }
    const auto values = forces_.row(i).head(seen_);
    if (lowest > kForceReserve * range) continue;
    if (!floors) FindForceFloors();
    floors = true;
    if (IsShared(i)) {
      open->Insert(i);
      continue;
    }
    const GuardBound bound =
        StageBound(*places_, &forces_(i, 0), static_cast<int>(forces_.rows()), probed);
    const double allowed = std::max(kForceResolved * range, floors_(i));
    if (!(bound.error <= allowed)) {
      *event = {false, kShorter, i};
      return false;
    }
    // The error of a quintic grows with the sixth power of the step.
    const double growth = std::pow(bound.error / allowed, -1.0 / 6);
    event->growth = std::min(event->growth, growth);
    const double reach = std::min(bound.lowest, lowest) - bound.error;
    const bool deeper = bound.dips && reach < margins_.force;
    for (int k = 0; lowest < -allowed && k < seen_; ++k) {
      const double place = places_->at[static_cast<std::size_t>(k)];
      if (values(k) < -allowed && place < pull->theta) *pull = {false, place, i};
    }
    if (reach <= floors_(i) || (deeper && lowest <= kForceMargin * range)) open->Insert(i);
  }
  return true;
}

/// The forces at some more places: those of a free step that are far from its stages. There the
/// motion is its own cubic Hermite interpolant, to far more than it takes to see a force pull.
void EventLocator::ProbeForces(int first, int count) {
  const double h = stepper_->step();
  if (places_->extended && !stepper_->extended()) stepper_->Extend();
  for (int k = first; k < first + count; ++k) {
    const double s = places_->at[static_cast<std::size_t>(k)], t = 1 - s;
    if (places_->extended) {
      stepper_->Interpolate(s, x_.data());
    } else {
      x_ = (t * t * (1 + 2 * s)) * stepper_->begin() + (t * t * s * h) * stepper_->begin_field() +
           (s * s * (1 + 2 * t)) * stepper_->end() - (s * s * t * h) * stepper_->end_field();
    }
    dynamics_->Evaluate(x_, mode_);
    const Eigen::Index n = dynamics_->system().num_constraints();
    forces_.col(k).head(n) = dynamics_->force().head(n);
    if (forces_.rows() == n) continue;
    for (int g : pushes_) forces_(g, k) = AtHand(g);
  }
  seen_ = first + count;
}

}  // namespace contact_flow
