// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "contact_flow/trajectory_optimization/policy.h"
#include "contact_flow/trajectory_optimization/receding_horizon.h"

namespace contact_flow {

/// Follows a policy, and then those that are offered to it while it does: each from its begin on,
/// where it has come by then and the robot has met what was expected until then, which may come as
/// late as TrackerOptions::patience. Beyond the end of the last one it goes back to the first
/// policy, which it follows on the side. It does not solve.
class RecedingTracker {
 public:
  /// With the policy that it begins with.
  explicit RecedingTracker(std::shared_ptr<const TrackingPolicy> policy,
                           const TrackerOptions& options = {});

  /// As of PolicyTracker.
  void Observe(double t, ConstraintSet activated, ConstraintSet released,
               std::optional<ConstraintSet> mode = {});
  /// The input at t for the state x [nq+d].
  Vector Input(double t, const VectorRef& x);

  /// Whether a solution waits for its begin: what is solved meanwhile would not know of it, and
  /// takes its place.
  bool Waits() const { return next_.has_value(); }
  /// What is to be solved for a solution that begins at `begin`.
  HorizonTask Task(double t, const VectorRef& x, double begin) const;
  /// Told the time when it has come [s]. It is followed from its begin on, unless it has no policy,
  /// the last input was asked for a later instant than that, or events tell another motion; then
  /// the last one is kept. Another one that waits for its begin gives way.
  void Offer(HorizonSolution solution);

  /// What became of a solution.
  struct Report {
    HorizonSolution solution;  ///< with its time and verdict; its policy has been let go
    bool followed = false;     ///< else the last policy was kept …
    std::string message;       ///< … and why
  };
  /// Those that have been decided, in their order.
  const std::vector<Report>& reports() const { return reports_; }

  /// That is followed now.
  const TrackingPolicy& policy() const { return *policy_; }
  int phase() const { return tracker_->phase(); }  ///< of its reference
  /// So far, beside the policies that were followed then.
  const std::vector<TrackedEvent>& events() const { return events_; }

 private:
  void Keep(HorizonSolution solution, const std::string& why);
  void Follow(std::shared_ptr<const TrackingPolicy> policy, const PolicyTracker& tracker);
  void Collect();
  void Begin(double t);
  bool IsExpected(const HorizonSolution& solution) const;
  bool MayCome(const HorizonSolution& solution, double t) const;

  const TrackerOptions options_;
  const std::shared_ptr<const TrackingPolicy> first_;
  std::optional<PolicyTracker> beside_;  // of the first policy, while others are followed
  std::shared_ptr<const TrackingPolicy> policy_;
  std::optional<PolicyTracker> tracker_;
  std::optional<HorizonSolution> next_;
  std::optional<ConstraintSet> mode_;
  std::vector<int> changes_;
  double last_;                // for which an input was asked [s]
  std::size_t collected_ = 0;  // events of the tracker
  std::vector<TrackedEvent> events_;
  std::vector<Report> reports_;
};

}  // namespace contact_flow
