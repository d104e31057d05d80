// SPDX-License-Identifier: BSD-3-Clause
#include "verify_session.h"

#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>

#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/serialize.h"
#include "src/ros/request/model_description.h"
#include "src/ros/request/session_messages.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr char kHeader[] = "another frame or number in its header than is recorded";

/// What is in a header besides the stamp.
bool HeaderIsOther(const std_msgs::Header& header) {
  return header.seq != 0 || !header.frame_id.empty();
}

}  // namespace

std::string SessionVerifier::Take(const RecordingStart& start, bool goes_on) {
  if (goes_on) return "";
  *this = SessionVerifier();
  start_ = start;
  for (std::size_t i = 0; i < start.setting_names.size() && i < start.setting_values.size(); ++i) {
    const std::string& name = start.setting_names[i];
    if (name == "tf_prefix") display_options_.prefix = start.setting_values[i];
    if (name == "base_frame") display_options_.base_frame = start.setting_values[i];
    if (name == "world_frame") display_options_.world_frame = start.setting_values[i];
  }
  return "";
}

std::string SessionVerifier::Take(const ModelDescription& model) {
  if (!model_) model_ = model;
  ModelDescription same = model;
  same.header = model_->header;
  if (same.parameters.size() == model_->parameters.size()) {
    for (std::size_t i = 0; i < same.parameters.size(); ++i) {
      same.parameters[i].value = model_->parameters[i].value;
    }
  }
  if (Serialize(same) != Serialize(*model_)) {
    return "another model than before: " + FirstDifference(same, *model_);
  }
  configuration_ = FromMsg(model);  // whatever has been begun goes on
  configuration_->options.max_seconds = kMostSeconds;
  if (!static_ && !terrain_) return "";
  const Display display(std::make_shared<const Setup>(*configuration_), display_options_);
  std::string difference;
  if (static_) {
    const ros::Time stamp =
        static_->transforms.empty() ? ros::Time() : static_->transforms.front().header.stamp;
    if (Serialize(*static_) != Serialize(display.Static(stamp))) {
      difference = "the fixed transforms before it are others";
    }
  }
  if (terrain_ &&
      (!display.has_terrain() || Serialize(*terrain_) != Serialize(display.Terrain()))) {
    difference = "the terrain before it is another";
  }
  static_.reset();
  terrain_.reset();
  return difference;
}

std::string SessionVerifier::Owed() const {
  if (owed_.empty()) return "";
  return "before it, inputs are missing that were told for later and still hold";
}

std::string SessionVerifier::Belongs(std::uint32_t epoch) const {
  if (run_ && epoch == epoch_) return Owed();
  return "of epoch " + std::to_string(epoch) + ", whose beginning is not in the bag before it";
}

bool SessionVerifier::AdvanceTo(double t) {
  if (!(t >= run_->flow()->now()) || !std::isfinite(t)) {
    throw std::invalid_argument("at t = " + std::to_string(t) +
                                " s, after t = " + std::to_string(run_->flow()->now()) + " s");
  }
  const bool event = run_->AdvanceTo(t);
  if (event) ++events_;
  return event;
}

bool SessionVerifier::ChangesNow() const {
  const auto& inputs = run_->flow()->inputs_to_come();
  return !inputs.empty() && inputs.front().t == run_->flow()->now();
}

std::string SessionVerifier::AdvanceQuietlyTo(double t) {
  if (!AdvanceTo(t)) {
    if (run_->flow()->now() == t) return "";
    return "the run has ended at " + std::to_string(run_->flow()->now()) + " s";
  }
  return "computed: an event at " + std::to_string(run_->flow()->now()) +
         " s that was not announced";
}

std::string SessionVerifier::Take(const SimulatorInput& input) {
  if (!owed_.empty()) {
    const SimulatorInput owed = owed_.front();
    owed_.pop_front();
    if (input.epoch != epoch_ || input.t != owed.t || input.input != owed.input) {
      owed_.clear();
      return "not the input that was told for t = " + std::to_string(owed.t) + " s";
    }
  }
  const std::string stranger = Belongs(input.epoch);
  if (!stranger.empty()) return stranger;
  if (HeaderIsOther(input.header)) return kHeader;
  run_->flow()->SetInput(input.t, FromMsg(input.input));
  return "";
}

std::string SessionVerifier::Take(const SimulatorEvent& event) {
  const std::string stranger = Belongs(event.epoch);
  if (!stranger.empty()) return stranger;
  if (HeaderIsOther(event.header)) return kHeader;
  const double t = event.transition.t;
  // What an input that begins there does, happens when time goes beyond it.
  if (!AdvanceTo(t) && !(ChangesNow() && AdvanceTo(std::nextafter(t, t + 1)))) {
    return "no event is computed up to its time";
  }
  if (!counting_) events_ = event.index;  // a recording that began later
  counting_ = true;
  SimulatorEvent computed = ToMsg(run_->system(), run_->flow()->transition(), epoch_, events_);
  computed.header = event.header;
  return Serialize(event) == Serialize(computed) ? "" : FirstDifference(event, computed);
}

std::string SessionVerifier::Take(const HybridState& state) {
  const std::string stranger = Belongs(state.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(state.t);
  if (!event.empty()) return event;
  if (!counting_) events_ = state.events;
  counting_ = true;
  HybridState computed = ToMsg(run_->system(), run_->Now(), epoch_, events_);
  computed.header.stamp = state.header.stamp;
  computed.header.frame_id = display_options_.world_frame;
  return Serialize(state) == Serialize(computed) ? "" : FirstDifference(state, computed);
}

std::string SessionVerifier::Take(const SimulatorMark& mark) {
  const std::string stranger = Belongs(mark.epoch);
  if (!stranger.empty()) return stranger;
  if (HeaderIsOther(mark.header)) return kHeader;
  const std::string event = AdvanceQuietlyTo(mark.t);
  if (!event.empty()) return event;
  run_->Mark(FromMsg(mark));
  return "";
}

std::string SessionVerifier::Take(const RollingTangents& tangents) {
  const std::string stranger = Belongs(tangents.epoch);
  if (!stranger.empty()) return stranger;
  if (!run_->marked()) return "no mark of its epoch is in the bag before it";
  RollingTangents computed =
      ToMsg(run_->system().description(), *run_->ReadMark(), epoch_);  // without a limit
  computed.header.stamp = tangents.header.stamp;
  return Serialize(tangents) == Serialize(computed) ? "" : FirstDifference(tangents, computed);
}

std::string SessionVerifier::Take(const PredictionRequest& request) {
  const std::string stranger = Belongs(request.epoch);
  if (!stranger.empty()) return stranger;
  if (HeaderIsOther(request.header)) return kHeader;
  const std::string event = AdvanceQuietlyTo(request.t);
  if (!event.empty()) return event;
  if (request.index <= last_asked_) return "not the next request of a prediction";
  last_asked_ = request.index;
  CheckMessage(request);
  const AskedPrediction asked = FromMsg(request);
  asked_[request.index] = {asked, run_->Present(asked)};
  return "";
}

std::string SessionVerifier::Take(const OutcomePrediction& prediction) {
  const auto asked = asked_.find(prediction.index);
  if (asked == asked_.end()) return "its request is not in the bag before it";
  OutcomePrediction computed =
      ToMsg(Predict(asked->second.snapshot, asked->second.request, nullptr));
  asked_.erase(asked);
  computed.header.stamp = prediction.header.stamp;
  return Serialize(prediction) == Serialize(computed) ? "" : FirstDifference(prediction, computed);
}

}  // namespace ros_interface
}  // namespace contact_flow
