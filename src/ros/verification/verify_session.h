// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "contact_flow/HybridState.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/OutcomePrediction.h"
#include "contact_flow/PredictionRequest.h"
#include "contact_flow/RecordingStart.h"
#include "contact_flow/RollingTangents.h"
#include "contact_flow/SimulatorEpoch.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/SimulatorInput.h"
#include "contact_flow/SimulatorMark.h"
#include "contact_flow/SimulatorSettings.h"
#include "contact_flow/SimulatorStatus.h"
#include "src/ros/display/display.h"
#include "src/session/epoch_run.h"

namespace contact_flow {
namespace ros_interface {

/// [s] of work that a recorded request may be given here.
constexpr double kMostSeconds = 3600;

/// Repeats a recorded session from its epochs, inputs, marks and requests of predictions alone,
/// message by message in the order they were recorded, and compares everything else with what comes
/// of it, bit for bit. Each call answers how the message differs, or "".
class SessionVerifier {
 public:
  /// A recording begins, or its next part.
  std::string Take(const RecordingStart& start, bool goes_on);
  std::string Take(const ModelDescription& model);
  /// Also compares where the epoch before has ended, and what can be computed of where
  /// this one begins.
  std::string Take(const SimulatorEpoch& epoch);
  std::string Take(const SimulatorInput& input);
  std::string Take(const SimulatorEvent& event);
  std::string Take(const HybridState& state);
  std::string Take(const SimulatorMark& mark);
  /// Of the instant of the state before it.
  std::string Take(const RollingTangents& tangents);
  std::string Take(const PredictionRequest& request);
  std::string Take(const OutcomePrediction& prediction);
  std::string Take(const SimulatorSettings& settings);
  /// What the clock says (lateness, overruns, …) is told, the rest compared.
  std::string Take(const SimulatorStatus& status);
  // What is shown of the present state.
  std::string Take(const sensor_msgs::JointState& joints);
  std::string Take(const geometry_msgs::WrenchStamped& wrench, const std::string& constraint);
  std::string TakeLinkWrench(const geometry_msgs::WrenchStamped& wrench, const std::string& link);
  std::string Take(const nav_msgs::Odometry& odometry);
  std::string Take(const sensor_msgs::Imu& imu);
  std::string TakeTransforms(const tf2_msgs::TFMessage& transforms);
  std::string TakeContacts(const visualization_msgs::MarkerArray& markers);
  // These are told before what they follow from.
  std::string TakeStatic(const tf2_msgs::TFMessage& transforms);
  std::string TakeTerrain(const visualization_msgs::MarkerArray& markers);
  std::string Take(const diagnostic_msgs::DiagnosticArray& diagnostics);
  /// After the last message of a recording.
  std::string End();

 private:
  /// Goes on to t, or to the next event before or at it: then true.
  bool AdvanceTo(double t);
  /// The same where no event may be: the difference when there is one, or "".
  std::string AdvanceQuietlyTo(double t);
  /// Whether an input begins right now, which may have been begun or not.
  bool ChangesNow() const;
  /// What must be there before anything happens in an epoch, or "".
  std::string Owed() const;
  /// The epoch a message must belong to; "" when it does.
  std::string Belongs(std::uint32_t epoch) const;

  std::string CompareWithBefore(const SimulatorEpoch& epoch, std::shared_ptr<const Setup> setup);
  std::string CompareWithStart(const SimulatorEpoch& epoch, const Setup& setup) const;
  std::string CompareParameters(const SimulatorEpoch& epoch) const;
  /// What is shown of now.
  const Display::OfState& Shown(const ros::Time& stamp);

  std::optional<RecordingStart> start_;
  DisplayOptions display_options_;
  std::optional<ModelDescription> model_;  // the first
  std::optional<Configuration> configuration_;
  std::unique_ptr<EpochRun> run_;
  std::deque<SimulatorInput> owed_;  // inputs told before the epoch that hold in it, too
  struct Asked {
    AskedPrediction request;
    Snapshot snapshot;
  };
  std::map<std::uint64_t, Asked> asked_;  // predictions to come, by index
  std::optional<SimulatorSettings> settings_;
  std::optional<tf2_msgs::TFMessage> static_;
  std::optional<visualization_msgs::MarkerArray> terrain_;
  std::optional<diagnostic_msgs::DiagnosticArray> diagnostics_;
  std::shared_ptr<const Setup> displayed_;
  std::unique_ptr<Display> display_;
  std::optional<Display::OfState> shown_;  // of now and of shown_stamp_
  ros::Time shown_stamp_;
  double shown_t_ = 0;
  std::uint64_t last_asked_ = 0;
  std::uint32_t epoch_ = 0;
  std::uint64_t events_ = 0;
  bool counting_ = false;  // events_ is known
};

}  // namespace ros_interface
}  // namespace contact_flow
