// SPDX-License-Identifier: BSD-3-Clause
#include "policy_loop.h"

#include <ros/console.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "contact_flow/mode_text.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// States that come while events are missing; then these are given up.
constexpr int kMostWaits = 100;
/// Events that wait for the states behind them; older ones are forgotten.
constexpr std::size_t kMostEvents = 10000;

void RequireSame(const char* field, const std::vector<std::string>& names,
                 const std::vector<std::string>& expected) {
  if (names == expected) return;
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  throw std::invalid_argument(std::string(field) + " are [" + list +
                              "], not those of the policy: it is of another model");
}

}  // namespace

PolicyLoop::PolicyLoop(TrackingPolicy policy, const TrackerOptions& options, double begin)
    : policy_(std::make_shared<const TrackingPolicy>(std::move(policy))),
      options_(options),
      asked_begin_(begin) {}

PolicyAnswer PolicyLoop::Take(const HybridState& state) {
  CheckMessage(state);
  RequireSame("coordinates", state.coordinates, policy_->names.coordinates);
  RequireSame("velocities", state.velocities, policy_->names.velocities);
  RequireSame("constraints", state.constraints, policy_->names.constraints);
  RequireSame("inputs", state.inputs, policy_->names.inputs);
  if (state.q.size() != state.coordinates.size() || state.v.size() != state.velocities.size()) {
    throw std::invalid_argument("q and v have " + std::to_string(state.q.size()) + " and " +
                                std::to_string(state.v.size()) + " entries, expected " +
                                std::to_string(state.coordinates.size()) + " and " +
                                std::to_string(state.velocities.size()));
  }
  if (!tracker_ || state.t < last_) BeginWith(state);
  waits_ = waiting_ ? waits_ + 1 : 0;
  waiting_ = state;
  return Answer();
}

PolicyAnswer PolicyLoop::Take(const SimulatorEvent& event) {
  CheckMessage(event);
  RequireSame("constraints", event.constraints, policy_->names.constraints);
  events_.push_back(event);
  if (events_.size() > kMostEvents) events_.pop_front();
  return Answer();
}

PolicyAnswer PolicyLoop::Take(const std_msgs::Header& header, double t, const Vector& x,
                              ConstraintSet activated, ConstraintSet released) {
  if (!tracker_ || t < last_) Begin(t);
  PolicyAnswer answer;
  mode_ = (mode_ | activated) - released;
  if (!(activated | released).Empty()) tracker_->Observe(t - begin_, activated, released, mode_);
  Step(header, t, x, &answer);
  return answer;
}

void PolicyLoop::Begin(double t) {
  begin_ = std::isnan(asked_begin_) ? t : asked_begin_;
  last_ = t;
  told_ = told_solves_ = 0;
  over_ = false;
  ++beginnings_;
  x_.resize(0);
  tracker_.emplace(policy_, options_);
}

void PolicyLoop::BeginWith(const HybridState& state) {
  Begin(state.t);
  passed_ = state.events;
  epoch_ = state.epoch;
  mode_ = SetOfNames("mode", state.mode, policy_->names.constraints);
  waiting_.reset();
  // What came before it is over; of what has begun anew there may be events already.
  while (!events_.empty() &&
         (events_.front().index <= passed_ || events_.front().epoch < state.epoch)) {
    events_.pop_front();
  }
}

PolicyAnswer PolicyLoop::Answer() {
  PolicyAnswer answer;
  if (!waiting_) return answer;
  const HybridState& state = *waiting_;
  while (passed_ < state.events && !events_.empty()) {
    const SimulatorEvent event = events_.front();
    events_.pop_front();
    if (event.index <= passed_) continue;
    passed_ = event.index;
    const auto mode = [this](const char* field, const std::vector<std::string>& names) {
      return SetOfNames(field, names, policy_->names.constraints);
    };
    const ContactTransition& m = event.transition;
    const ConstraintSet down = mode("activated", m.activated) | mode("switched", m.switched);
    const ConstraintSet up = mode("released", m.released);
    if ((down | up).Empty() || m.t < begin_) continue;
    mode_ = mode("mode_after", m.mode_after);
    tracker_->Observe(m.t - begin_, down, up, mode_);
    TellEvents(event.header, &answer);
  }
  if (passed_ < state.events) {
    if (waits_ < kMostWaits) return answer;
    ROS_WARN_THROTTLE(1, "policy_tracker: %llu events have not come: going on without",
                      static_cast<unsigned long long>(state.events - passed_));
    passed_ = state.events;
  }
  if (state.epoch != epoch_) {  // it was pushed or moved: no events tell what touches now
    const ConstraintSet mode = SetOfNames("mode", state.mode, policy_->names.constraints);
    if (mode != mode_) tracker_->Observe(state.t - begin_, mode - mode_, mode_ - mode, mode);
    mode_ = mode;
    epoch_ = state.epoch;
  }
  Vector x(static_cast<Eigen::Index>(state.q.size() + state.v.size()));
  x << Eigen::Map<const Vector>(state.q.data(), static_cast<Eigen::Index>(state.q.size())),
      Eigen::Map<const Vector>(state.v.data(), static_cast<Eigen::Index>(state.v.size()));
  Step(state.header, state.t, x, &answer);
  waiting_.reset();
  return answer;
}

void PolicyLoop::Step(const std_msgs::Header& header, double t, const Vector& x,
                      PolicyAnswer* answer) {
  last_ = t;
  const double since = t - begin_;
  const ReferencePhase& last = policy_->reference.phases().back();
  over_ = since > last.t_end;
  x_.resize(0);
  if (since < 0 || over_) return;
  x_ = x;
  PolicyStep step;
  step.header = header;
  step.t = since;
  step.input = ToMsg(VectorRef(tracker_->Input(since, x)));
  TellEvents(header, answer);
  TellSolves(header, answer);
  const ExtendedReference& reference = tracker_->policy().reference;
  const int phase = options_.extend ? tracker_->phase() : reference.PhaseAt(since);
  step.phase = static_cast<std::uint32_t>(phase);
  step.error = ToMsg(VectorRef(reference.Error(phase, since, x)));
  answer->step = step;
}

std::optional<PolicyLoop::Ahead> PolicyLoop::Task(double lead) const {
  if (!tracker_ || tracker_->Waits() || x_.size() == 0) return {};
  const double since = last_ - begin_, begin = since + lead;
  if (begin >= policy_->reference.inputs().grid.back()) return {};
  return Ahead{tracker_->Task(since, x_, begin), beginnings_};
}

void PolicyLoop::Offer(HorizonSolution solution, std::uint64_t number) {
  if (tracker_ && number == beginnings_) tracker_->Offer(std::move(solution));
}

void PolicyLoop::TellEvents(const std_msgs::Header& header, PolicyAnswer* answer) {
  for (; told_ < tracker_->events().size(); ++told_) {
    const TrackedEvent& event = tracker_->events()[told_];
    PolicyEvent m;
    m.header = header;
    m.kind = KindName(event.kind);
    m.t = event.t;
    m.expected = event.expected;
    m.constraints = event.constraints.Names(policy_->names.constraints);
    m.phase = static_cast<std::uint32_t>(tracker_->phase());
    answer->events.push_back(m);
  }
}

void PolicyLoop::TellSolves(const std_msgs::Header& header, PolicyAnswer* answer) {
  for (; told_solves_ < tracker_->reports().size(); ++told_solves_) {
    const RecedingTracker::Report& report = tracker_->reports()[told_solves_];
    const HorizonSolution& solution = report.solution;
    PolicySolve m;
    m.header = header;
    m.verdict = VerdictName(solution.verdict);
    m.followed = report.followed;
    m.message = solution.message;
    if (!report.followed && report.message != solution.message) {
      m.message += "; the last policy is kept: " + report.message;
    }
    m.t = solution.t;
    m.begin = solution.begin;
    m.seconds = solution.seconds;
    m.iterations = static_cast<std::uint32_t>(solution.iterations);
    m.first_cost = solution.first_cost;
    m.cost = solution.cost;
    answer->solves.push_back(m);
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
