// SPDX-License-Identifier: BSD-3-Clause
// What follows from the state of a recorded session at each instant.
#include <algorithm>

#include "src/ros/message/conversions.h"
#include "src/ros/message/serialize.h"
#include "verify_session.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kLongestStep = 20;  // [s], between two instants of a simulator
constexpr char kNoState[] = "there is no state before it";

template <class Message>
std::string Difference(const Message& recorded, const Message& computed) {
  return Serialize(recorded) == Serialize(computed) ? "" : FirstDifference(recorded, computed);
}

}  // namespace

const Display::OfState& SessionVerifier::Shown(const ros::Time& stamp) {
  if (displayed_ != run_->setup()) {
    displayed_ = run_->setup();
    display_ = std::make_unique<Display>(displayed_, display_options_);
    shown_.reset();
  }
  if (!shown_ || shown_stamp_ != stamp || shown_t_ != run_->flow()->now()) {
    shown_ = display_->Show(run_->Now(), stamp);
    shown_stamp_ = stamp;
    shown_t_ = run_->flow()->now();
  }
  return *shown_;
}

std::string SessionVerifier::Take(const sensor_msgs::JointState& joints) {
  if (!run_) return kNoState;
  return Difference(joints, Shown(joints.header.stamp).joints);
}

std::string SessionVerifier::Take(const geometry_msgs::WrenchStamped& wrench,
                                  const std::string& constraint) {
  if (!run_) return kNoState;
  const std::vector<geometry_msgs::WrenchStamped>& wrenches = Shown(wrench.header.stamp).wrenches;
  const std::vector<std::string>& names = run_->system().description().constraints;
  for (std::size_t i = 0; i < names.size() && i < wrenches.size(); ++i) {
    if (names[i] == constraint) return Difference(wrench, wrenches[i]);
  }
  return "of no constraint of the model";
}

std::string SessionVerifier::TakeLinkWrench(const geometry_msgs::WrenchStamped& wrench,
                                            const std::string& link) {
  if (!run_) return kNoState;
  const std::vector<geometry_msgs::WrenchStamped>& wrenches =
      Shown(wrench.header.stamp).link_wrenches;
  const std::vector<std::string> links = display_->touching_links();
  for (std::size_t i = 0; i < links.size(); ++i) {
    if (links[i] == link) return Difference(wrench, wrenches[i]);
  }
  return "of no link that touches";
}

std::string SessionVerifier::Take(const nav_msgs::Odometry& odometry) {
  if (!run_) return kNoState;
  const std::vector<nav_msgs::Odometry>& shown = Shown(odometry.header.stamp).odometry;
  return shown.empty() ? "of a base that does not move" : Difference(odometry, shown[0]);
}

std::string SessionVerifier::Take(const sensor_msgs::Imu& imu) {
  if (!run_) return kNoState;
  const std::vector<sensor_msgs::Imu>& shown = Shown(imu.header.stamp).imu;
  return shown.empty() ? "of a base that does not move" : Difference(imu, shown[0]);
}

std::string SessionVerifier::TakeTransforms(const tf2_msgs::TFMessage& message) {
  if (!run_) return kNoState;
  if (message.transforms.empty()) return "without a transform";
  return Difference(message, Shown(message.transforms.front().header.stamp).transforms);
}

std::string SessionVerifier::TakeContacts(const visualization_msgs::MarkerArray& message) {
  if (!run_) return kNoState;
  const ros::Time stamp =
      message.markers.empty() ? shown_stamp_ : message.markers.front().header.stamp;
  return Difference(message, Shown(stamp).contacts);
}

std::string SessionVerifier::TakeStatic(const tf2_msgs::TFMessage& message) {
  static_ = message;
  return "";
}

std::string SessionVerifier::TakeTerrain(const visualization_msgs::MarkerArray& message) {
  terrain_ = message;
  return "";
}

std::string SessionVerifier::Take(const diagnostic_msgs::DiagnosticArray& message) {
  const bool waits = diagnostics_.has_value();
  diagnostics_ = message;
  return waits ? "the status of the one before is missing" : "";
}

std::string SessionVerifier::Take(const SimulatorSettings& settings) {
  settings_ = settings;
  return settings.header.seq == 0 && settings.header.frame_id.empty() ? ""
                                                                      : "its header is another";
}

std::string SessionVerifier::Take(const SimulatorStatus& status) {
  const std::string stranger = Belongs(status.epoch);
  if (!stranger.empty()) return stranger;
  const std::string event = AdvanceQuietlyTo(status.t);
  if (!event.empty()) return event;
  if (!counting_) events_ = status.events;
  counting_ = true;
  // A run ends where it cannot go on, which only who tries to knows.
  if (status.outcome != 0 && run_->flow()->status().ok() &&
      (AdvanceTo(status.t + kLongestStep) || run_->flow()->now() != status.t)) {
    return "the run goes on beyond the end that is told";
  }
  const Status& run = run_->flow()->status();
  const std::vector<std::string>& constraints = run_->system().description().constraints;
  SimulatorStatus computed = status;
  computed.header = std_msgs::Header();
  computed.header.stamp = status.header.stamp;
  computed.outcome = static_cast<std::uint8_t>(run.outcome);
  computed.message = run.message;
  computed.events = events_;
  if (settings_) computed.real_time_factor = settings_->real_time_factor;
  computed.mode = run_->flow()->mode().Names(constraints);
  computed.constraints = constraints;
  computed.mode_word = ToWord(constraints, run_->flow()->mode());
  const auto feel = [&] {
    const Vector force = run.ok() ? run_->Force() : Vector();
    const auto n = static_cast<Eigen::Index>(constraints.size());
    computed.force = ToMsg(VectorRef(force.head(std::min(n, force.size()))));
    computed.tangential_force = Tangential(run_->system().description(), force);
  };
  feel();
  computed.margins = ToMsg(run_->flow()->margins());
  if (run.ok() && !status.paused) computed.why.clear();
  std::string difference = Difference(status, computed);
  if (!difference.empty() && ChangesNow()) {  // told when the step had been cut there
    run_->flow()->Settle();
    feel();
    difference = Difference(status, computed);
  }
  if (!difference.empty() || !diagnostics_) return difference;
  const diagnostic_msgs::DiagnosticArray told = *std::exchange(diagnostics_, std::nullopt);
  return start_ &&
                 Serialize(told) != Serialize(ToDiagnostics(status, start_->node,
                                                            run_->system().description().name, ""))
             ? "the diagnostics before it are others"
             : "";
}

std::string SessionVerifier::End() {
  std::string difference = Owed();
  if (diagnostics_) difference = "the status of the last diagnostics is missing";
  if (static_ || terrain_) difference = "the model of the last terrain is missing";
  return difference;
}

}  // namespace ros_interface
}  // namespace contact_flow
