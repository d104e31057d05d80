// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/verify_session.h"

#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/ros/conversions.h"
#include "contact_flow/ros/serialize.h"
#include "contact_flow/ros/session.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Refused requests are never answered; at most 64 others are under way at once.
constexpr std::size_t kMaxOpenRequests = 1024;

Vector Join(const std::vector<double>& q, const std::vector<double>& v) {
  Vector x(static_cast<Eigen::Index>(q.size() + v.size()));
  std::copy(q.begin(), q.end(), x.data());
  std::copy(v.begin(), v.end(), x.data() + q.size());
  return x;
}

Vector ToVector(const std::vector<double>& values) {
  return Eigen::Map<const Vector>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// How two vectors differ, or "". Bits count: −0 is not 0.
std::string Compare(const std::string& what, const Vector& recorded, const Vector& computed) {
  const auto size = static_cast<std::size_t>(recorded.size()) * sizeof(double);
  if (recorded.size() == computed.size() &&
      std::memcmp(recorded.data(), computed.data(), size) == 0) {
    return "";
  }
  std::ostringstream text;
  text.precision(17);
  text << what << ": recorded (" << recorded.transpose() << "), computed (" << computed.transpose()
       << ")";
  return text.str();
}

}  // namespace

std::string SessionVerifier::Take(const ModelDescription& model) {
  configuration_ = FromMsg(model);  // whatever has been begun goes on
  return "";
}

std::string SessionVerifier::Belongs(std::uint32_t epoch) const {
  if (flow_ && epoch == epoch_) return "";
  return "of epoch " + std::to_string(epoch) + ", whose beginning is not in the bag before it";
}

bool SessionVerifier::AdvanceTo(double t) {
  while (true) {
    const bool passed = flow_->AdvanceTo(t);
    if (mark_) mark_->Follow(flow_.get(), passed);
    if (!passed) return false;
    const Transition& transition = flow_->transition();
    if (transition.changes_input && transition.mode_before == transition.mode_after) continue;
    ++events_;
    return true;
  }
}

std::string SessionVerifier::AdvanceQuietlyTo(double t) {
  if (!AdvanceTo(t)) return "";
  return "computed: an event at " + std::to_string(flow_->now()) + " s that was not announced";
}

std::string SessionVerifier::Take(const SimulatorEpoch& epoch) {
  if (!configuration_) return "no model before it";
  std::string difference;
  const bool follows = flow_ && epoch.epoch == epoch_ + 1 && !epoch.q_before.empty();
  Vector before;
  if (follows) {
    const std::string event = AdvanceQuietlyTo(epoch.t_before);
    if (!event.empty()) return event;
    flow_->Settle();
    before = flow_->State();
    difference =
        Compare("the end of the epoch before", Join(epoch.q_before, epoch.v_before), before);
  }
  Configuration configuration = *configuration_;
  for (std::size_t i = 0; i < epoch.parameter_names.size(); ++i) {
    configuration.parameters[epoch.parameter_names[i]] = epoch.parameter_values.at(i);
  }
  const auto setup = std::make_shared<const Setup>(configuration);
  const Vector x = Join(epoch.q, epoch.v);
  if (difference.empty() && follows) {
    Vector expected = before;
    ProjectContacts(*setup_->system, flow_->mode(), &expected);
    if (epoch.cause == "apply_impulse") Push(*setup_, ToVector(epoch.impulse), &expected);
    if (epoch.cause == "reset_world" || epoch.cause == "reset_simulation") {
      expected = setup->system->nominal().x;
    }
    if (epoch.cause == "set_state") expected = x;  // told from outside
    difference = Compare("the beginning of the epoch", x, expected);
  }
  mark_.reset();
  setup_ = setup;
  const std::shared_ptr<const MechanicalSystem> system(setup_, setup_->system.get());
  const Vector u = ToVector(epoch.input);
  flow_ = std::make_unique<OnlineFlow>(system, epoch.t, x, u, setup_->options);
  dynamics_ = std::make_unique<ContactDynamics>(*system, u);
  epoch_ = epoch.epoch;
  if (!first_epoch_) first_epoch_ = epoch_;
  if (epoch.cause == "start" || epoch.cause == "reset_simulation") {
    events_ = 0;
    counting_ = true;
  }
  return difference;
}

std::string SessionVerifier::Take(const SimulatorInput& input) {
  const std::string stranger = Belongs(input.epoch);
  if (!stranger.empty()) return stranger;
  flow_->SetInput(input.t, ToVector(input.input));
  return "";
}

std::string SessionVerifier::Take(const SimulatorEvent& event) {
  const std::string stranger = Belongs(event.epoch);
  if (!stranger.empty()) return stranger;
  if (!AdvanceTo(event.transition.t)) return "no event is computed up to its time";
  if (!counting_) events_ = event.index;  // a recording that began later
  counting_ = true;
  SimulatorEvent computed = event;
  computed.index = events_;
  computed.changes_input = flow_->transition().changes_input;
  computed.transition = ToMsg(setup_->system->description(), flow_->transition());
  return Serialize(event) == Serialize(computed) ? "" : FirstDifference(event, computed);
}

std::string SessionVerifier::Take(const HybridState& state) {
  const std::string stranger = Belongs(state.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(state.t);
  if (!event.empty()) return event;
  const MechanicalSystem& system = *setup_->system;
  const Vector x = flow_->State();
  dynamics_->SetInput(flow_->NextInput());
  dynamics_->Evaluate(x, flow_->mode());
  if (!counting_) events_ = state.events;
  counting_ = true;
  HybridState computed = state;
  computed.events = events_;
  computed.mode = flow_->mode().Names(system.description().constraints);
  computed.q = ToMsg(VectorRef(x.head(system.num_positions())));
  computed.v = ToMsg(VectorRef(x.tail(system.dof())));
  computed.force = ToMsg(VectorRef(dynamics_->force().head(system.num_constraints())));
  computed.input = ToMsg(VectorRef(flow_->NextInput()));
  return Serialize(state) == Serialize(computed) ? "" : FirstDifference(state, computed);
}

std::string SessionVerifier::Take(const SimulatorMark& mark) {
  const std::string stranger = Belongs(mark.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(mark.t);
  if (!event.empty()) return event;
  mark_.reset();
  if (mark.clear) {
    flow_->KeepMotion(false);
  } else {
    mark_ = std::make_unique<MarkedInstant>(*setup_, flow_.get(), mark);
  }
  return "";
}

std::string SessionVerifier::Take(const RollingTangents& tangents) {
  const std::string stranger = Belongs(tangents.epoch);
  if (!stranger.empty()) return stranger;
  if (!mark_) return "no mark of its epoch is in the bag before it";
  RollingTangents computed = mark_->Message(flow_.get());
  computed.header = tangents.header;
  computed.epoch = epoch_;
  return Serialize(tangents) == Serialize(computed) ? "" : FirstDifference(tangents, computed);
}

std::string SessionVerifier::Take(const PredictionRequest& request) {
  const std::string stranger = Belongs(request.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(request.t);
  if (!event.empty()) return event;
  asked_[request.index] = {request, TakeSnapshot(setup_, flow_.get())};
  if (asked_.size() > kMaxOpenRequests) asked_.erase(asked_.begin());
  return "";
}

std::string SessionVerifier::Take(const OutcomePrediction& prediction) {
  const auto asked = asked_.find(prediction.index);
  if (asked == asked_.end()) return "its request is not in the bag before it";
  OutcomePrediction computed = Predict(asked->second.snapshot, asked->second.request, nullptr);
  asked_.erase(asked);
  computed.header = prediction.header;
  return Serialize(prediction) == Serialize(computed) ? "" : FirstDifference(prediction, computed);
}

}  // namespace ros_interface
}  // namespace contact_flow
