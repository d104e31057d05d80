// SPDX-License-Identifier: BSD-3-Clause
#include "verify.h"

#include <exception>
#include <ostream>
#include <stdexcept>
#include <utility>

#include "verify_result.h"

namespace contact_flow {
namespace ros_interface {

BagVerifier::BagVerifier(std::ostream* out, Options options)
    : out_(out),
      options_(std::move(options)),
      chain_(options_.key),
      repeater_(std::make_unique<Repeater>(options_.max_seconds)) {}
BagVerifier::~BagVerifier() = default;

void BagVerifier::Line(const BagMessage& message, const std::string& verdict) {
  *out_ << message.time << " " << message.connection->at("topic") << ": " << verdict << "\n";
}

/// Where something before it is missing, that may be the reason.
void BagVerifier::Differs(const BagMessage& message, const std::string& how) {
  if (number_ >= sound_) {
    ++result_.gaps;
    return Line(message, "NOT VERIFIED, since something before it is missing: " + how);
  }
  ++result_.differing;
  Line(message, "DIFFERS: " + how);
}

void BagVerifier::Gap(const std::string& what) {
  ++result_.gaps;
  *out_ << path_ << ": NOT VERIFIED: " << what << "\n";
}

void BagVerifier::Take(const std::string& path) {
  path_ = path;
  const std::string bytes = ReadRegularFile(path);
  const BagContent bag = ReadBag(bytes);
  const ChainCheck::Report report = chain_.Take(bag);
  for (const std::string& difference : report.differences) {
    ++result_.differing;
    *out_ << path << ": DIFFERS: " << difference << "\n";
  }
  for (const std::string& gap : report.gaps) Gap(gap);
  sound_ = report.sound;
  goes_on_ = report.goes_on;
  number_ = 0;
  if (!goes_on_) {
    EndRecording();
    start_.reset();
    roles_.clear();
    time_ = ros::Time();
  }
  for (const BagMessage& message : bag.messages) {
    try {
      Handle(message);
    } catch (const std::exception& error) {
      Differs(message, error.what());
    }
    time_ = message.time;
    ++number_;
  }
}

void BagVerifier::EndRecording() {
  const std::string difference = session_.End();
  if (!difference.empty()) Gap(difference);
  if (!copies_.empty()) Gap("a copy of the last record is missing");
  copies_.clear();
  session_ = SessionVerifier();
}

const Verification& BagVerifier::Finish() {
  EndRecording();
  const std::string missing = chain_.End();
  if (!missing.empty()) Gap("of the recording, " + missing);
  if (result_.skipped > 0) Gap(std::to_string(result_.skipped) + " messages of other kinds");
  return result_;
}

void BagVerifier::Handle(const BagMessage& message) {
  const auto caller = message.connection->find("callerid");
  if (start_ && caller != message.connection->end() && caller->second != start_->node) {
    Differs(message, "sent by " + caller->second + ", not by " + start_->node);
  }
  if (Start(message) || Link(message) || Model(message)) return;
  if (TakeResult(message) || TakeOnline(message) || Shown(message)) return;
  ++result_.skipped;
}

std::string BagVerifier::RoleOf(const BagMessage& message) const {
  const auto found = roles_.find(message.connection->at("topic"));
  return found == roles_.end() ? "" : found->second;
}

void BagVerifier::CheckTopic(const BagMessage& message, const std::string& role) {
  if (start_ && RoleOf(message) != role) {
    throw std::runtime_error("not on the topic of " + role);
  }
}

/// Times in the bag are the stamps, or just after the message before, where that is there.
void BagVerifier::CheckStamp(const BagMessage& message, const ros::Time& stamp) {
  if (stamp == message.time || number_ >= sound_) return;
  if (stamp < message.time && message.time == time_ + ros::Duration(0, 1)) return;
  throw std::runtime_error("its stamp is not the time at which it was recorded");
}

bool BagVerifier::Start(const BagMessage& message) {
  if (!Is<RecordingStart>(message)) return false;
  const RecordingStart start = Deserialize<RecordingStart>(message);
  if (start.header.stamp != message.time) throw std::runtime_error("its stamp is another");
  if (start.roles.size() != start.topics.size()) throw std::runtime_error("roles and topics");
  if (start.parameter_names.size() != start.parameter_values.size() ||
      start.setting_names.size() != start.setting_values.size()) {
    throw std::runtime_error("names and values are not as many");
  }
  session_.Take(start, goes_on_);
  if (start_) {  // another part: what it is made with is the same
    RecordingStart same = start;
    same.header = start_->header;
    same.part = start_->part;
    same.messages = start_->messages;
    same.previous = start_->previous;
    if (Serialize(same) != Serialize(*start_)) Differs(message, FirstDifference(same, *start_));
  }
  start_ = start;
  for (std::size_t i = 0; i < start.roles.size(); ++i) roles_[start.topics[i]] = start.roles[i];
  return true;
}

bool BagVerifier::Link(const BagMessage& message) {
  if (!Is<RecordingLink>(message)) return false;
  if (!copies_.empty()) {
    const std::string missing = copies_.begin()->first;
    copies_.clear();
    Differs(message, "before it, the " + missing + " of the last record is missing");
  }
  const RecordingLink link = Deserialize<RecordingLink>(message);
  if (link.header.stamp != message.time) Differs(message, "its stamp is another");
  return true;
}

bool BagVerifier::Model(const BagMessage& message) {
  if (!Is<ModelDescription>(message)) return false;
  const bool online = start_ && start_->kind == "online";
  const auto description =
      Get<ModelDescription>(message, online ? "online_model" : "model_description");
  const std::string difference = repeater_->Take(description);
  if (difference.empty()) {
    Line(message, description.name);
  } else {
    Differs(message, difference);
  }
  const std::string other = session_.Take(description);
  if (!other.empty()) Differs(message, other);
  return true;
}

/// What the simulator has recorded.
template <class Message>
bool BagVerifier::Online(const BagMessage& message, const char* role, bool announced) {
  if (!Is<Message>(message)) return false;
  const std::string difference = session_.Take(Get<Message>(message, role));
  if (!difference.empty()) {
    Differs(message, difference);
    return true;
  }
  ++result_.verified;
  if (announced) Line(message, "same, bit for bit");
  return true;
}

bool BagVerifier::TakeOnline(const BagMessage& message) {
  constexpr bool kAnnounced = true;
  return Online<SimulatorEpoch>(message, "epoch", kAnnounced) ||
         Online<SimulatorInput>(message, "input_taken") ||
         Online<SimulatorEvent>(message, "events", kAnnounced) ||
         Online<HybridState>(message, "state") ||
         Online<SimulatorMark>(message, "mark_taken", kAnnounced) ||
         Online<RollingTangents>(message, "rolling_derivative") ||
         Online<PredictionRequest>(message, "prediction_asked") ||
         Online<OutcomePrediction>(message, "prediction", kAnnounced) ||
         Online<SimulatorSettings>(message, "settings") ||
         Online<SimulatorStatus>(message, "status") ||
         Online<diagnostic_msgs::DiagnosticArray>(message, "diagnostics") ||
         Online<sensor_msgs::JointState>(message, "joint_states") ||
         Online<nav_msgs::Odometry>(message, "odom") || Online<sensor_msgs::Imu>(message, "imu");
}

/// What the simulator shows, by topics whose kind does not say what they are.
bool BagVerifier::Shown(const BagMessage& message) {
  const std::string role = RoleOf(message);
  std::string difference;
  if (Is<geometry_msgs::WrenchStamped>(message) && role.compare(0, 7, "wrench/") == 0) {
    difference = session_.Take(Get<geometry_msgs::WrenchStamped>(message, role), role.substr(7));
  } else if (Is<geometry_msgs::WrenchStamped>(message) &&
             role.compare(0, 12, "link_wrench/") == 0) {
    difference =
        session_.TakeLinkWrench(Get<geometry_msgs::WrenchStamped>(message, role), role.substr(12));
  } else if (Is<tf2_msgs::TFMessage>(message) && (role == "tf" || role == "tf_static")) {
    const auto transforms = Deserialize<tf2_msgs::TFMessage>(message);
    for (const auto& transform : transforms.transforms) {
      CheckStamp(message, transform.header.stamp);
    }
    difference =
        role == "tf" ? session_.TakeTransforms(transforms) : session_.TakeStatic(transforms);
  } else if (Is<visualization_msgs::MarkerArray>(message) &&
             (role == "contacts" || role == "terrain")) {
    const auto markers = Deserialize<visualization_msgs::MarkerArray>(message);
    if (role == "contacts" && !markers.markers.empty()) {
      CheckStamp(message, markers.markers.front().header.stamp);
    }
    difference =
        role == "contacts" ? session_.TakeContacts(markers) : session_.TakeTerrain(markers);
  } else {
    return false;
  }
  if (difference.empty()) {
    ++result_.verified;
  } else {
    Differs(message, difference);
  }
  return true;
}

}  // namespace ros_interface
}  // namespace contact_flow
