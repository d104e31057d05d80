// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/trajectory_optimization/extended_reference.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Weights of the regulator that follows a reference,
///   Σ_k h_k (δx_kᵀ Q δx_k + δu_kᵀ R δu_k) + δx(T)ᵀ Q_T δx(T),  all diagonal.
struct TrackingWeights {
  Vector state;     ///< Q ≥ 0 [2d]
  Vector input;     ///< R > 0 [m]
  Vector terminal;  ///< Q_T ≥ 0 [2d]
};

/// What the numbers of a policy are called, as in SystemDescription.
struct PolicyNames {
  std::string model;                     ///< whose it is
  std::vector<std::string> coordinates;  ///< [nq]
  std::vector<std::string> units;        ///< [nq] of them
  std::vector<std::string> velocities;   ///< [d]
  std::vector<std::string> constraints;  ///< [n]
  std::vector<std::string> inputs;       ///< [m]
};

/// How a reference is followed: u = ū(t) − K (x ⊟ x̄(t)), with the gain of an instant of the input's
/// grid and the phase of the motion.
struct TrackingPolicy {
  PolicyNames names;             ///< of its numbers
  ExtendedReference reference;   ///< x̄, with both one-sided states at events, and ū
  std::vector<Matrix> gains;     ///< K of each interval of the grid [m × 2d]
  std::vector<int> gain_phases;  ///< the phase in which each begins
  /// Intervals at which the outcome is only piecewise linear: their gains are of one piece.
  std::vector<int> kinked;
  Vector lower;  ///< of the inputs [m], −∞ of those without; empty: none
  Vector upper;  ///< as lower, ∞

  /// K in a phase at t: of the interval at t if it begins in this phase, else of the nearest one
  /// that does.
  const Matrix& Gain(int phase, double t) const;
};

/// Why a run has no policy: an interval of its grid has no derivative.
class NoPolicy : public std::domain_error {
 public:
  /// With the status of that interval.
  explicit NoPolicy(Status status)
      : std::domain_error(status.message), status_(std::move(status)) {}
  const Status& status() const { return status_; }  ///< of that interval

 private:
  Status status_;
};

/// The policy of a trajectory made with SimulateOptions::dense under these inputs. Gains by the
/// linear regulator along the exact derivatives of the intervals, saltations inside; the reference
/// goes on by `reach` [s] beyond its events. Throws std::invalid_argument for sizes and signs and
/// as ExtendedReference does, and NoPolicy where an interval has no derivative by the changes of
/// its input in the cones.
TrackingPolicy MakePolicy(const MechanicalSystem& system, const Trajectory& run,
                          const InputSchedule& inputs, double reach, const TrackingWeights& weights,
                          const BDerivativeOptions& options = {}, const InputCones& cones = {});

/// Throws std::invalid_argument, naming field and value, for a policy that is not in order: sizes,
/// times that do not rise, phases that do not follow each other, gains without an interval.
void CheckPolicy(const TrackingPolicy& policy);

/// Settings of a tracker.
struct TrackerOptions {
  bool extend = true;     ///< false: errors are those to the reference of the time, which jumps
  double on_time = 1e-3;  ///< touchdowns closer than this to the reference's are on time [s]
  double patience = 0.1;  ///< an event later than this is missed, one earlier is extra [s]
};

/// An event beside that of the reference.
struct TrackedEvent {
  /// How it came.
  enum class Kind { kOnTime, kEarly, kLate, kMissed, kExtra };
  Kind kind = Kind::kOnTime;  ///< this one
  double t = 0;               ///< when it came; for a missed one when it was given up [s]
  double expected = 0;        ///< by the reference; NaN for an extra one [s]
  ConstraintSet constraints;  ///< of it
};

/// "on time", …
const char* KindName(TrackedEvent::Kind kind);

/// Follows a policy by what is told of the motion: contacts that touch down and let go move it on
/// to the next phase of the reference, whenever they come.
class PolicyTracker {
 public:
  /// `policy` must outlive it.
  explicit PolicyTracker(const TrackingPolicy& policy, const TrackerOptions& options = {});

  /// Contacts touch down, or let go, at t; `mode` is what touches from then on, where it is known.
  /// Where the reference expects several at once, the phase ends with the last. What comes earlier
  /// than by `patience` is not what is expected. Others are passed over where the robot is then in
  /// the mode of a later phase, whose begin is not further from t than `patience`, and which such
  /// events lead to: feet may come in another order. What a later phase expects within `patience`
  /// has come for it, and is told at once. Else they are extra events. Instants of the reference
  /// need not be told, and where no contact does anything nothing changes.
  void Observe(double t, ConstraintSet activated, ConstraintSet released,
               std::optional<ConstraintSet> mode = {});
  /// The input at t for the state x [nq+d].
  Vector Input(double t, const VectorRef& x);
  int phase() const { return phase_; }  ///< of the reference
  /// So far.
  const std::vector<TrackedEvent>& events() const { return events_; }

 private:
  /// What has come of what is expected at the end of a phase.
  struct Progress {
    ConstraintSet touched, left;
    ConstraintSet told;  // of these, ahead of the phase
  };

  const ReferencePhase& At(int phase) const;
  ConstraintSet ModeAt(int phase) const;
  ConstraintSet Expected(int phase) const;
  bool IsComplete() const;
  void GiveUpLate(double t);
  bool Follow(double t, ConstraintSet changed);
  int Match(double t, ConstraintSet changed, ConstraintSet mode) const;
  bool ComeAhead(double t, int contact, bool down);
  void TakeBack(int contact, bool down);
  void Tell(double t, double due, ConstraintSet came);
  void Pass(double t);
  void PassComplete(double t);

  const TrackingPolicy& policy_;
  const TrackerOptions options_;
  int phase_ = 0;
  std::vector<Progress> progress_;     // by phase
  std::optional<ConstraintSet> mode_;  // that the robot is in, if it is told
  ConstraintSet seen_;                 // what has touched down or let go since then
  std::vector<TrackedEvent> events_;
};

}  // namespace contact_flow
