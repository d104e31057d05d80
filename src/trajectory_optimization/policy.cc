// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/policy.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "contact_flow/derivative/linearization.h"

namespace contact_flow {
namespace {

void RequireWeights(const Vector& weights, Eigen::Index size, bool positive,
                    const std::string& name) {
  if (weights.size() != size) {
    throw std::invalid_argument(name + " has " + std::to_string(weights.size()) +
                                " entries: " + std::to_string(size) + " are needed");
  }
  for (double weight : weights) {
    const bool right = positive ? weight > 0 : weight >= 0;
    if (!right || !std::isfinite(weight)) {
      throw std::invalid_argument(name + " must be finite and " + (positive ? "> 0" : "≥ 0"));
    }
  }
}

}  // namespace

TrackingPolicy MakePolicy(const MechanicalSystem& system, const Trajectory& run,
                          const InputSchedule& inputs, double reach, const TrackingWeights& weights,
                          const BDerivativeOptions& options, const InputCones& cones) {
  if (system.num_inputs() == 0) {
    throw std::invalid_argument("the model has no inputs: there is nothing to steer with");
  }
  RequireWeights(weights.state, 2 * system.dof(), false, "state");
  RequireWeights(weights.input, system.num_inputs(), true, "input");
  RequireWeights(weights.terminal, 2 * system.dof(), false, "terminal");
  const SystemDescription& names = system.description();
  TrackingPolicy policy{{names.name, names.coordinates, names.units, names.velocities,
                         names.constraints, names.inputs},
                        ExtendedReference(system, run, inputs, reach),
                        {},
                        {},
                        {},
                        {},
                        {}};
  const std::vector<IntervalLinearization> intervals = Linearize(system, run, options, cones);
  policy.gains.resize(intervals.size());
  Matrix P = weights.terminal.asDiagonal();
  for (std::size_t k = intervals.size(); k-- > 0;) {
    const IntervalLinearization& interval = intervals[k];
    if (!interval.status.ok()) throw NoPolicy(interval.status);
    if (!interval.is_linear) policy.kinked.insert(policy.kinked.begin(), static_cast<int>(k));
    const double h = interval.t_end - interval.t_begin;
    const Matrix &A = interval.A, &B = interval.B;
    Matrix S = B.transpose() * P * B;
    S.diagonal() += h * weights.input;
    policy.gains[k] = S.llt().solve(B.transpose() * P * A);
    const Matrix closed = A - B * policy.gains[k];
    Matrix next = closed.transpose() * P * closed +
                  h * policy.gains[k].transpose() * weights.input.asDiagonal() * policy.gains[k];
    next.diagonal() += h * weights.state;
    P = 0.5 * (next + next.transpose());
  }
  for (const IntervalLinearization& interval : intervals) {
    // The phase just behind its begin.
    int phase = policy.reference.PhaseAt(interval.t_begin);
    const auto& phases = policy.reference.phases();
    while (phase + 1 < static_cast<int>(phases.size()) &&
           phases[static_cast<std::size_t>(phase)].t_end <= interval.t_begin) {
      ++phase;
    }
    policy.gain_phases.push_back(phase);
  }
  return policy;
}

const Matrix& TrackingPolicy::Gain(int phase, double t) const {
  const std::vector<double>& grid = reference.inputs().grid;
  const auto next = std::upper_bound(grid.begin(), grid.end(), t);
  const std::size_t at =
      std::min(gains.size() - 1,
               next == grid.begin() ? 0 : static_cast<std::size_t>(next - grid.begin()) - 1);
  // Phases of the intervals do not fall: the nearest one lies towards that phase.
  std::size_t k = at;
  while (k > 0 && gain_phases[k] > phase) --k;
  while (k + 1 < gains.size() && gain_phases[k] < phase) ++k;
  return gains[gain_phases[k] == phase ? k : at];
}

const char* KindName(TrackedEvent::Kind kind) {
  constexpr const char* kNames[] = {"on time", "early", "late", "missed", "extra"};
  return kNames[static_cast<int>(kind)];
}

PolicyTracker::PolicyTracker(const TrackingPolicy& policy, const TrackerOptions& options)
    : policy_(policy), options_(options), progress_(policy.reference.phases().size()) {}

const ReferencePhase& PolicyTracker::At(int phase) const {
  return policy_.reference.phases()[static_cast<std::size_t>(phase)];
}

/// The contacts of a phase.
ConstraintSet PolicyTracker::ModeAt(int phase) const {
  return At(phase).mode.Members() - policy_.reference.instants();
}

/// What touches down or lets go at the end of a phase; nothing at the last one's.
ConstraintSet PolicyTracker::Expected(int phase) const {
  if (phase + 1 == static_cast<int>(policy_.reference.phases().size())) return {};
  return At(phase).activated | At(phase).released;
}

/// Whether all that was expected at the end of the phase has come.
bool PolicyTracker::IsComplete() const {
  const Progress& progress = progress_[static_cast<std::size_t>(phase_)];
  return !Expected(phase_).Empty() && progress.touched == At(phase_).activated &&
         progress.left == At(phase_).released;
}

void PolicyTracker::Observe(double t, ConstraintSet activated, ConstraintSet released,
                            std::optional<ConstraintSet> mode) {
  GiveUpLate(t);
  const ConstraintSet instants = policy_.reference.instants();
  activated = activated - instants;
  released = released - instants;
  const ConstraintSet changed = activated | released;
  if (mode) mode_ = *mode - instants;
  if (changed.Empty()) return;
  if (!mode) mode_.reset();
  seen_ = seen_ | changed;
  // What comes far too early is not what is expected.
  const bool near = !Expected(phase_).Empty() && t >= At(phase_).t_end - options_.patience;
  Progress& progress = progress_[static_cast<std::size_t>(phase_)];
  const ConstraintSet down =
      near ? At(phase_).activated - (progress.told & progress.touched) : ConstraintSet();
  const ConstraintSet up =
      near ? At(phase_).released - (progress.told & progress.left) : ConstraintSet();
  progress.touched = progress.touched | (activated & down);
  progress.left = progress.left | (released & up);
  const ConstraintSet other_down = activated - down, other_up = released - up;
  const bool complete = near && IsComplete();
  if (!(complete && (other_down | other_up).Empty()) && Follow(t, changed)) {
    return PassComplete(t);
  }
  ConstraintSet extra;
  for (int i : other_down) {
    TakeBack(i, false);
    if (!ComeAhead(t, i, true)) extra.Insert(i);
  }
  for (int i : other_up) {
    TakeBack(i, true);
    if (!ComeAhead(t, i, false)) extra.Insert(i);
  }
  if (!extra.Empty()) {
    events_.push_back(
        {TrackedEvent::Kind::kExtra, t, std::numeric_limits<double>::quiet_NaN(), extra});
  }
  if (!complete) return;
  Pass(t);
  seen_ = ConstraintSet();
  PassComplete(t);
}

/// Whether a later phase expects this within the patience: it has come for that one.
bool PolicyTracker::ComeAhead(double t, int contact, bool down) {
  const int last = static_cast<int>(policy_.reference.phases().size()) - 1;
  for (int k = phase_ + 1; k < last && At(k).t_end <= t + options_.patience; ++k) {
    Progress& progress = progress_[static_cast<std::size_t>(k)];
    ConstraintSet& come = down ? progress.touched : progress.left;
    const ConstraintSet expected = down ? At(k).activated : At(k).released;
    if (At(k).t_end < t - options_.patience) continue;
    if (!expected.Contains(contact) || come.Contains(contact)) continue;
    come.Insert(contact);
    progress.told.Insert(contact);
    Tell(t, At(k).t_end, ConstraintSet({contact}));
    return true;
  }
  return false;
}

/// What has come for a later phase is undone: it is expected again.
void PolicyTracker::TakeBack(int contact, bool down) {
  for (std::size_t k = static_cast<std::size_t>(phase_) + 1; k < progress_.size(); ++k) {
    ConstraintSet& come = down ? progress_[k].touched : progress_[k].left;
    if (!come.Contains(contact)) continue;
    come.Erase(contact);
    progress_[k].told.Erase(contact);
    return;
  }
}

/// Goes over to the later phase that the robot is in, by events of its own; false: there is none.
bool PolicyTracker::Follow(double t, ConstraintSet changed) {
  if (!mode_) return false;
  const int next = Match(t, changed, *mode_);
  if (next == phase_) return false;
  while (phase_ < next) Pass(t);
  seen_ = ConstraintSet();
  return true;
}

/// The later phase that the robot is in, or this one.
int PolicyTracker::Match(double t, ConstraintSet changed, ConstraintSet mode) const {
  int best = phase_;
  double least = options_.patience;
  ConstraintSet on_the_way;
  for (int k = phase_ + 1; k < static_cast<int>(policy_.reference.phases().size()); ++k) {
    on_the_way = on_the_way | Expected(k - 1);
    const double distance = std::abs(At(k).t_begin - t);
    if (At(k).t_begin > t + options_.patience) break;
    if (ModeAt(k) != mode || !(changed - on_the_way).Empty()) continue;
    if (distance > least) continue;
    least = distance;
    best = k;
  }
  return best;
}

void PolicyTracker::Tell(double t, double due, ConstraintSet came) {
  const double late = t - due;
  const TrackedEvent::Kind kind = std::abs(late) <= options_.on_time ? TrackedEvent::Kind::kOnTime
                                  : late < 0                         ? TrackedEvent::Kind::kEarly
                                                                     : TrackedEvent::Kind::kLate;
  if (!came.Empty()) events_.push_back({kind, t, due, came});
}

/// On to the next phase by what has been seen at t or before; the rest is missed.
void PolicyTracker::Pass(double t) {
  const ConstraintSet expected =
      Expected(phase_) - progress_[static_cast<std::size_t>(phase_)].told;
  const ConstraintSet missing = expected - seen_;
  const double due = At(phase_).t_end;
  Tell(t, due, expected - missing);
  if (!missing.Empty()) events_.push_back({TrackedEvent::Kind::kMissed, t, due, missing});
  ++phase_;
}

/// On over phases whose ends have come before they began.
void PolicyTracker::PassComplete(double t) {
  while (IsComplete()) Pass(t);
}

/// What has not come within the patience will not: the reference goes on without, up to the time
/// or to a phase in which the robot is. A phase that ends without a touchdown or release, as where
/// slip ends, does so by its time.
void PolicyTracker::GiveUpLate(double t) {
  const int last = static_cast<int>(policy_.reference.phases().size()) - 1;
  const auto over = [&](double patience) { return t > At(phase_).t_end + patience; };
  while (phase_ < last) {
    const bool by_time = Expected(phase_).Empty();
    if (!over(by_time ? 0 : options_.patience)) return;
    do {
      const Progress& progress = progress_[static_cast<std::size_t>(phase_)];
      const ConstraintSet missing = Expected(phase_) - (progress.touched | progress.left);
      if (!missing.Empty()) {
        events_.push_back({TrackedEvent::Kind::kMissed, t, At(phase_).t_end, missing});
      }
      seen_ = ConstraintSet();
      ++phase_;
    } while (!by_time && phase_ < last && over(0) && mode_ && *mode_ != ModeAt(phase_));
    PassComplete(t);
  }
}

Vector PolicyTracker::Input(double t, const VectorRef& x) {
  GiveUpLate(t);
  // Contacts that came far too early wait here for their phase.
  if (mode_ && *mode_ != ModeAt(phase_) && Follow(t, {})) PassComplete(t);
  const ExtendedReference& reference = policy_.reference;
  const int phase = options_.extend ? phase_ : reference.PhaseAt(t);
  Vector u = reference.Input(t) - policy_.Gain(phase, t) * reference.Error(phase, t, x);
  if (policy_.lower.size() > 0) u = u.cwiseMax(policy_.lower);
  if (policy_.upper.size() > 0) u = u.cwiseMin(policy_.upper);
  return u;
}

}  // namespace contact_flow
