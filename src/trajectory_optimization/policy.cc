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

void Require(const Vector& weights, Eigen::Index size, bool positive, const std::string& name) {
  if (weights.size() != size) {
    throw std::invalid_argument(name + " has " + std::to_string(weights.size()) + " entries: " +
                                std::to_string(size) + " are needed");
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
                          const InputSchedule& inputs, double reach,
                          const TrackingWeights& weights, const BDerivativeOptions& options) {
  if (system.num_inputs() == 0) {
    throw std::invalid_argument("the model has no inputs: there is nothing to steer with");
  }
  Require(weights.state, 2 * system.dof(), false, "state");
  Require(weights.input, system.num_inputs(), true, "input");
  Require(weights.terminal, 2 * system.dof(), false, "terminal");
  const SystemDescription& names = system.description();
  TrackingPolicy policy{{names.name, names.coordinates, names.units, names.velocities,
                         names.constraints, names.inputs},
                        ExtendedReference(system, run, inputs, reach), {}, {}, {}, {}, {}};
  const std::vector<IntervalLinearization> intervals = Linearize(system, run, options);
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
    : policy_(policy), options_(options) {}

void PolicyTracker::Observe(double t, ContactMode activated, ContactMode released) {
  GiveUpLate(t);
  const auto& phases = policy_.reference.phases();
  const ReferencePhase& phase = phases[static_cast<std::size_t>(phase_)];
  const bool last = phase_ + 1 == static_cast<int>(phases.size());
  const ContactMode expected_down = last ? ContactMode() : phase.activated.Members();
  const ContactMode expected_up = last ? ContactMode() : phase.released.Members();
  const ContactMode extra = (activated.Members() - expected_down) |
                            (released.Members() - expected_up);
  if (!extra.Empty()) {
    events_.push_back({TrackedEvent::Kind::kExtra, t, std::numeric_limits<double>::quiet_NaN(),
                       extra});
  }
  touched_ = touched_ | (activated.Members() & expected_down);
  left_ = left_ | (released.Members() & expected_up);
  const bool complete = touched_ == expected_down && left_ == expected_up;
  if (last || !complete || (touched_ | left_).Empty()) return;
  const double late = t - phase.t_end;
  const TrackedEvent::Kind kind = std::abs(late) <= options_.on_time ? TrackedEvent::Kind::kOnTime
                                  : late < 0 ? TrackedEvent::Kind::kEarly
                                             : TrackedEvent::Kind::kLate;
  events_.push_back({kind, t, phase.t_end, touched_ | left_});
  touched_ = left_ = ContactMode();
  ++phase_;
}

/// What has not come within the patience will not: the reference goes on without.
void PolicyTracker::GiveUpLate(double t) {
  const auto& phases = policy_.reference.phases();
  while (phase_ + 1 < static_cast<int>(phases.size())) {
    const ReferencePhase& phase = phases[static_cast<std::size_t>(phase_)];
    if (!(t > phase.t_end + options_.patience)) return;
    const ContactMode missing =
        (phase.activated.Members() - touched_) | (phase.released.Members() - left_);
    events_.push_back({TrackedEvent::Kind::kMissed, t, phase.t_end, missing});
    touched_ = left_ = ContactMode();
    ++phase_;
  }
}

Vector PolicyTracker::Input(double t, const VectorRef& x) {
  GiveUpLate(t);
  const ExtendedReference& reference = policy_.reference;
  const int phase = options_.extend ? phase_ : reference.PhaseAt(t);
  Vector u = reference.Input(t) - policy_.Gain(phase, t) * reference.Error(phase, t, x);
  if (policy_.lower.size() > 0) u = u.cwiseMax(policy_.lower);
  if (policy_.upper.size() > 0) u = u.cwiseMin(policy_.upper);
  return u;
}

}  // namespace contact_flow
