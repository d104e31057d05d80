// SPDX-License-Identifier: BSD-3-Clause
#include "germ.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>

#include "cluster_geometry.h"
#include "contact_flow/budget.h"
#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
/// Rounding of rates and accelerations, relative to the terms that they are sums of.
constexpr double kGermNoise = 1e-10;
/// More impacts of first-order speed than this between two activations are not followed.
constexpr int kMaxStrikes = 10000;
/// A force below this part of the terms of its acceleration is still about to vanish.
constexpr double kGermNearZero = 1e-6;

Matrix Block(const Matrix& G, ConstraintSet rows, ConstraintSet columns, ConstraintSet all) {
  Matrix block(rows.Size(), columns.Size());
  const auto place = [&](int i) { return (all & ConstraintSet::All(i)).Size(); };
  int r = 0;
  for (int i : rows) {
    int c = 0;
    for (int j : columns) block(r, c++) = G(place(i), place(j));
    ++r;
  }
  return block;
}

}  // namespace

Germ::Germ(const EventMap& map, const VectorRef& w)
    : map_(map), w_(w), stage_(&map.StageAt(ConstraintSet())) {
  closed_ = stage_->mode - map.Aside();
}

double Germ::Rate(int j) const { return map_.InstantAt(S_).rates.Along(j, w_); }

double Germ::GapAcceleration(int j) const {
  return map_.InstantAt(S_).rates.Along(j, stage_->field);
}

double Germ::RateNoise(int j) const { return kGermNoise * map_.InstantAt(S_).rates.Terms(j, w_); }

double Germ::AccelerationNoise(int j) const {
  return kGermNoise * map_.InstantAt(S_).rates.Terms(j, stage_->field);
}

const InverseInertia& Germ::inertia() const { return *map_.geometry_->inertia(); }

void Germ::Refuse(int j, const char* why) const {
  std::ostringstream message;
  message << "at t = " << map_.transition_.t << " s the contact '"
          << map_.system_->description().constraints[j]
          << "' opens inside the cluster in this direction and " << why;
  throw std::domain_error(message.str());
}

/// The first positive root of gap + r t + ä t²/2 with the gap closing there.
double Germ::ClosingTime(int j, double gap) const {
  double rate = Rate(j), acceleration = GapAcceleration(j);
  if (std::abs(rate) <= RateNoise(j)) rate = 0;
  if (std::abs(acceleration) <= AccelerationNoise(j)) acceleration = 0;
  if (gap == 0 && (rate == 0 || below_.Contains(j))) return kNever;  // it has just been let go
  const double discriminant = rate * rate - 2 * acceleration * gap;
  if (rate < 0) {
    return discriminant >= 0 ? 2 * gap / (-rate + std::sqrt(discriminant)) : kNever;
  }
  return acceleration < 0 ? (rate + std::sqrt(discriminant)) / -acceleration : kNever;
}

/// The bounces take 2r/|ä| (1 + γ + γ² + …).
double Germ::RestTime(int j) const {
  const double acceleration = GapAcceleration(j), restitution = map_.system_->restitution()(j);
  if (!(acceleration < -AccelerationNoise(j)) || restitution >= 1) return kNever;
  return 2 * Rate(j) / (-acceleration * (1 - restitution));
}

Germ::Next Germ::FindNext() const {
  Next next;
  next.in = kNever;
  const auto offer = [&next](Kind kind, int i, double in) {
    if (next.kind != Kind::kNone && !(in < next.in)) return;
    if (kind != Kind::kActivation && in == kNever) return;
    next = {kind, i, in};
  };
  for (int i : map_.Remaining(S_)) {
    offer(Kind::kActivation, i, map_.TimeTo(i, *stage_, w_));
  }
  OfferReleases(&next);
  for (const auto& [j, gap] : gaps_) offer(Kind::kClosing, j, ClosingTime(j, gap));
  // Where nothing else happens before it, infinitely many bounces are one event.
  if (next.kind != Kind::kClosing || !bouncing_.Contains(next.constraint)) return next;
  const int j = next.constraint;
  const double rest = gaps_.at(j) > 0 || !(Rate(j) > 0) ? kNever : RestTime(j);
  if (rest == kNever) return next;
  for (int i : map_.Remaining(S_)) {
    if (map_.TimeTo(i, *stage_, w_) <= rest) return next;
  }
  for (const auto& [other, gap] : gaps_) {
    if (other != j && ClosingTime(other, gap) <= rest) return next;
  }
  return {Kind::kRest, j, rest};
}

void Germ::OfferReleases(Next* next) const {
  if (!lists_events_ || pending_.Empty()) return;
  const ContactMode mode = stage_->mode.Union(ContactMode(pending_));
  ContactDynamics& dynamics = map_.DynamicsAfter(S_);
  dynamics.Differentiate(map_.State(stage_->v), mode);
  const Matrix gradient = dynamics.force_jacobian();
  const Vector field = dynamics.Field(map_.State(stage_->v), mode);
  for (int i : pending_) {
    double in = -gradient.row(i).dot(w_.head(map_.width())) / gradient.row(i).dot(field);
    if (!S_.Empty()) in = std::max(in, 0.0);
    if (std::isfinite(in) && in < next->in) *next = {Kind::kRelease, i, in};
  }
}

void Germ::Advance(double time) {
  for (auto& [j, gap] : gaps_) {
    gap = std::max(0.0, gap + time * (Rate(j) + GapAcceleration(j) * time / 2));
  }
  w_ += time * stage_->field;
  elapsed_ += time;
}

ConstraintSet Germ::Strike(ConstraintSet touching, ConstraintSet kept, bool plastic) {
  const ConstraintSet all = touching | kept;
  const Matrix A = inertia().Rows(all);
  const Matrix reach = inertia() * A.transpose();
  const Matrix G = A * reach;
  Vector b(touching.Size());
  int row = 0;
  for (int j : touching) {
    const double restitution = plastic ? 0 : map_.system_->restitution()(j);
    b(row++) = closed_.Contains(j) ? 0 : (1 + restitution) * Rate(j);
  }
  // With those in `kept` eliminated: p_kept = −G_kk⁻¹ G_kt p.
  Matrix reduced = Block(G, touching, touching, all), answer;
  if (!kept.Empty()) {
    const Matrix mixed = Block(G, kept, touching, all);
    answer = Block(G, kept, kept, all).llt().solve(mixed);
    reduced -= mixed.transpose() * answer;
  }
  const std::optional<ComplementaritySolution> found = SolveComplementarity(reduced, b);
  if (!found) Refuse(*touching.begin(), "touches others that depend on it");
  const ComplementaritySolution& solution = *found;
  Vector impulse = Vector::Zero(all.Size());
  const Vector others = kept.Empty() ? Vector() : Vector(-answer * solution.z);
  int r = 0, t = 0, k = 0;
  for (int j : all) impulse(r++) = touching.Contains(j) ? solution.z(t++) : others(k++);
  w_.segment(map_.system_->dof(), map_.system_->dof()) += reach * impulse;
  ConstraintSet leaving;
  for (int j : touching) {
    if (Rate(j) > RateNoise(j)) leaving.Insert(j);
  }
  return leaving;
}

void Germ::Enter(ConstraintSet candidates) {
  for (const auto& [j, gap] : gaps_) {  // what has had no time to open
    if (gap == 0 && std::abs(Rate(j)) <= RateNoise(j)) candidates.Insert(j);
  }
  stage_ = &map_.StageAt(S_, candidates & map_.InstantAt(S_).resting);
  closed_ = stage_->mode - map_.Aside();
  for (int j : closed_) gaps_.erase(j);
  for (int j : candidates - closed_) {
    gaps_[j] = 0;
    bouncing_.Erase(j);
  }
  bouncing_ = bouncing_ - closed_;
}

/// Of the forces that are about to vanish, those that an impact has made finite are no more.
void Germ::KeepPending() {
  released_ = ConstraintSet();
  if (!lists_events_) return;
  for (int j : pending_) {
    ContactDynamics& dynamics = map_.DynamicsAfter(S_);
    dynamics.Evaluate(map_.State(stage_->v), stage_->mode.With(j));
    const Vector& force = dynamics.force();
    const bool finite = std::abs(force(j)) > kGermNearZero * force.cwiseAbs().maxCoeff();
    if (finite || !map_.InstantAt(S_).resting.Contains(j)) pending_.Erase(j);
  }
}

void Germ::PassActivation(int i) {
  const EventMap::Passage& passage = map_.PassageAt(S_, closed_, i);
  const ConstraintSet free = passage.disturbed & closed_;
  w_ = (free.Empty() ? passage.reset : passage.free) * w_;
  S_.Insert(i);
  const ConstraintSet resting = map_.InstantAt(S_).resting;
  for (auto it = gaps_.begin(); it != gaps_.end();) {
    const int j = it->first;
    const bool goes = passage.struck.Contains(j) || !resting.Contains(j);
    it = goes ? gaps_.erase(it) : std::next(it);
    if (goes) bouncing_.Erase(j);
  }
  ConstraintSet candidates = passage.held;
  if (!free.Empty()) {
    closed_ = candidates - free;
    const ConstraintSet lifted = Strike(free, closed_.With(i), true);
    for (int j : lifted) gaps_[j] = 0;
    candidates = candidates - lifted;
  }
  below_ = ConstraintSet();
  if (passage.disturbed.Contains(i) && std::abs(Rate(i)) > RateNoise(i)) {
    // A plastic contact whose restitution changes: it rises, or (γ < 0, out of the domain) does
    // what makes the map linear.
    gaps_[i] = 0;
    candidates.Erase(i);
    if (Rate(i) < 0) below_.Insert(i);
  }
  strikes_ = 0;
  Enter(candidates);
  if (!below_.Empty() && map_.StageAt(S_, candidates.With(i)).mode.Contains(i)) {
    below_.Erase(i);  // what holds it takes its rate
    Rest(i);
  }
  KeepPending();
}

void Germ::PassClosing(int j) {
  const bool last = S_ == map_.events_;
  if (++strikes_ > kMaxStrikes) {
    if (!last || map_.system_->restitution()(j) >= 1 || strikes_ > 2 * kMaxStrikes) {
      Refuse(j, "bounces without coming to rest");
    }
    // Plastic impacts of coupled contacts that go on and on: at their end all rest.
    for (int i : map_.transition_.mode_after - map_.Aside()) gaps_[i] = 0;
    return Rest(j);
  }
  if (Rate(j) >= -RateNoise(j)) return Rest(j);
  gaps_[j] = 0;
  const ConstraintSet touching = closed_.With(j);
  const ConstraintSet leaving = Strike(touching, ConstraintSet(), false);
  if (leaving.Contains(j)) bouncing_.Insert(j);
  for (int i : leaving) gaps_[i] = 0;
  Enter(touching - leaving);
}

/// j comes to rest, and what is at zero with it.
void Germ::Rest(int j) {
  ConstraintSet held = closed_.With(j);
  for (const auto& [i, gap] : gaps_) {
    if (gap == 0 && map_.transition_.mode_after.Contains(i) && strikes_ > kMaxStrikes) {
      held.Insert(i);
    }
  }
  const Matrix A = inertia().Rows(held);
  const Matrix reach = inertia() * A.transpose();
  Vector rates(held.Size());
  int row = 0;
  for (int i : held) rates(row++) = Rate(i);
  w_.segment(map_.system_->dof(), map_.system_->dof()) -= reach * (A * reach).llt().solve(rates);
  for (int i : held) gaps_.erase(i);
  Enter(held);
}

void Germ::CheckEnd() const {
  for (const auto& [j, gap] : gaps_) {
    if (!map_.transition_.mode_after.Contains(j)) continue;
    Refuse(j, "is neither pressed nor left to first order: which mode follows is not known");
  }
  for (int j : map_.transition_.mode_after - stage_->mode) {
    if (!map_.events_.Empty()) Refuse(j, "does not return to the contact mode that follows");
  }
}

Vector Germ::Run(std::vector<PerturbedEvent>* events) {
  lists_events_ = events != nullptr;
  pending_ = map_.transition_.vanishing - map_.events_;
  for (;;) {
    AskBudget();
    const Next next = FindNext();
    if (next.kind == Kind::kNone) break;
    Advance(next.in);
    PerturbedEvent event;
    event.constraint = next.constraint;
    event.time = elapsed_;
    bool told = true;
    switch (next.kind) {
      case Kind::kActivation:
        event.kind = map_.IsInputChange(next.constraint) ? PerturbedEvent::Kind::kInput
                                                         : PerturbedEvent::Kind::kActivation;
        PassActivation(next.constraint);
        break;
      case Kind::kRelease:
        event.kind = PerturbedEvent::Kind::kRelease;
        pending_.Erase(next.constraint);
        released_.Insert(next.constraint);
        break;
      default:
        event.kind = PerturbedEvent::Kind::kClosing;
        next.kind == Kind::kRest ? Rest(next.constraint) : PassClosing(next.constraint);
        told = closed_.Contains(next.constraint);
    }
    if (!lists_events_ || !told) continue;
    event.mode = stage_->mode.Union(ContactMode(pending_)).Without(released_);
    events->push_back(event);
  }
  CheckEnd();
  return w_ - elapsed_ * stage_->field;
}

}  // namespace contact_flow
