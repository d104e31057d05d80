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
  if (run_ && epoch == epoch_) return "";
  return "of epoch " + std::to_string(epoch) + ", whose beginning is not in the bag before it";
}

bool SessionVerifier::AdvanceTo(double t) {
  const bool event = run_->AdvanceTo(t);
  if (event) ++events_;
  return event;
}

std::string SessionVerifier::AdvanceQuietlyTo(double t) {
  if (!AdvanceTo(t)) return "";
  return "computed: an event at " + std::to_string(run_->flow()->now()) +
         " s that was not announced";
}

std::string SessionVerifier::Take(const SimulatorEpoch& epoch) {
  if (!configuration_) return "no model before it";
  std::string difference;
  const bool follows = run_ && epoch.epoch == epoch_ + 1 && !epoch.q_before.empty();
  Vector before;
  if (follows) {
    const std::string event = AdvanceQuietlyTo(epoch.t_before);
    if (!event.empty()) return event;
    run_->flow()->Settle();
    before = run_->flow()->State();
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
    ProjectContacts(run_->system(), run_->flow()->mode(), &expected);
    if (epoch.cause == "apply_impulse") Push(*run_->setup(), ToVector(epoch.impulse), &expected);
    if (epoch.cause == "reset_world" || epoch.cause == "reset_simulation") {
      expected = setup->system->nominal().x;
    }
    if (epoch.cause == "set_state") expected = x;  // told from outside
    difference = Compare("the beginning of the epoch", x, expected);
  }
  run_ = std::make_unique<EpochRun>(setup, epoch.t, x, ToVector(epoch.input));
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
  run_->flow()->SetInput(input.t, ToVector(input.input));
  return "";
}

std::string SessionVerifier::Take(const SimulatorEvent& event) {
  const std::string stranger = Belongs(event.epoch);
  if (!stranger.empty()) return stranger;
  if (!AdvanceTo(event.transition.t)) return "no event is computed up to its time";
  if (!counting_) events_ = event.index;  // a recording that began later
  counting_ = true;
  SimulatorEvent computed = run_->EventMsg();
  computed.header = event.header;
  computed.epoch = epoch_;
  computed.index = events_;
  return Serialize(event) == Serialize(computed) ? "" : FirstDifference(event, computed);
}

std::string SessionVerifier::Take(const HybridState& state) {
  const std::string stranger = Belongs(state.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(state.t);
  if (!event.empty()) return event;
  if (!counting_) events_ = state.events;
  counting_ = true;
  HybridState computed = run_->StateMsg();
  computed.header = state.header;
  computed.epoch = epoch_;
  computed.events = events_;
  return Serialize(state) == Serialize(computed) ? "" : FirstDifference(state, computed);
}

std::string SessionVerifier::Take(const SimulatorMark& mark) {
  const std::string stranger = Belongs(mark.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(mark.t);
  if (!event.empty()) return event;
  run_->Mark(mark);
  return "";
}

std::string SessionVerifier::Take(const RollingTangents& tangents) {
  const std::string stranger = Belongs(tangents.epoch);
  if (!stranger.empty()) return stranger;
  if (!run_->marked()) return "no mark of its epoch is in the bag before it";
  RollingTangents computed = *run_->TangentsMsg();  // without a limit
  computed.header = tangents.header;
  computed.epoch = epoch_;
  return Serialize(tangents) == Serialize(computed) ? "" : FirstDifference(tangents, computed);
}

std::string SessionVerifier::Take(const PredictionRequest& request) {
  const std::string stranger = Belongs(request.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(request.t);
  if (!event.empty()) return event;
  asked_[request.index] = {request, run_->Present(request)};
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
