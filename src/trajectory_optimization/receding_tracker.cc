// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/receding_tracker.h"

#include <limits>
#include <utility>

namespace contact_flow {

RecedingTracker::RecedingTracker(std::shared_ptr<const TrackingPolicy> policy,
                                 const TrackerOptions& options)
    : options_(options),
      first_(std::move(policy)),
      policy_(first_),
      tracker_(std::in_place, *first_, options),
      changes_(first_->names.constraints.size(), 0),
      last_(-std::numeric_limits<double>::infinity()) {}

void RecedingTracker::Observe(double t, ConstraintSet activated, ConstraintSet released,
                              std::optional<ConstraintSet> mode) {
  Begin(t);
  const ConstraintSet instants = first_->reference.instants();
  if (mode) mode_ = *mode - instants;
  if (!mode && !((activated | released) - instants).Empty()) mode_.reset();
  for (int i : activated - instants) ++changes_[static_cast<std::size_t>(i)];
  for (int i : released - instants) ++changes_[static_cast<std::size_t>(i)];
  tracker_->Observe(t, activated, released, mode);
  if (beside_) beside_->Observe(t, activated, released, mode);
  Collect();
}

Vector RecedingTracker::Input(double t, const VectorRef& x) {
  Begin(t);
  last_ = t;
  const Vector u = tracker_->Input(t, x);
  Collect();
  return u;
}

HorizonTask RecedingTracker::Task(double t, const VectorRef& x, double begin) const {
  return {t, x, begin, policy_, *tracker_, changes_};
}

void RecedingTracker::Offer(HorizonSolution solution) {
  if (next_) Keep(std::move(*next_), "the next solution has come before it began");
  next_.reset();
  if (solution.policy == nullptr) {
    const std::string why = solution.message;
    return Keep(std::move(solution), why);
  }
  if (last_ > solution.begin) return Keep(std::move(solution), "it has come after its begin");
  next_ = std::move(solution);
}

/// Whether what has happened is what was to happen by the begin of a solution.
bool RecedingTracker::IsExpected(const HorizonSolution& solution) const {
  const ConstraintSet mode = solution.mode.Members() - first_->reference.instants();
  return changes_ == solution.changes && (!mode_ || *mode_ == mode);
}

/// Whether it may yet become so by t.
bool RecedingTracker::MayCome(const HorizonSolution& solution, double t) const {
  if (t > solution.begin + options_.patience || changes_ == solution.changes) return false;
  for (std::size_t i = 0; i < changes_.size(); ++i) {
    if (changes_[i] > solution.changes[i]) return false;
  }
  return true;
}

/// Goes over to what begins at t or before, and back to the first policy behind the end of others.
void RecedingTracker::Begin(double t) {
  if (next_ && t >= next_->begin && !MayCome(*next_, t)) {
    HorizonSolution solution = std::move(*next_);
    next_.reset();
    if (IsExpected(solution)) {
      if (!beside_) beside_.emplace(*tracker_);
      Follow(solution.policy, PolicyTracker(*solution.policy, options_));
      solution.policy.reset();
      reports_.push_back({std::move(solution), true, ""});
    } else {
      Keep(std::move(solution),
           "contacts were met or left that were not to be by its begin, or "
           "not met or left that were");
    }
  }
  if (!beside_ || t <= policy_->reference.phases().back().t_end) return;
  Follow(first_, *beside_);
  beside_.reset();
}

void RecedingTracker::Follow(std::shared_ptr<const TrackingPolicy> policy,
                             const PolicyTracker& tracker) {
  tracker_.emplace(tracker);
  policy_ = std::move(policy);
  collected_ = tracker_->events().size();
}

void RecedingTracker::Keep(HorizonSolution solution, const std::string& why) {
  solution.policy.reset();
  reports_.push_back({std::move(solution), false, why});
}

void RecedingTracker::Collect() {
  for (; collected_ < tracker_->events().size(); ++collected_) {
    events_.push_back(tracker_->events()[collected_]);
  }
}

}  // namespace contact_flow
