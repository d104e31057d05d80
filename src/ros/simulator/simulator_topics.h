// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/ModelDescription.h"
#include "contact_flow/SimulatorSettings.h"
#include "contact_flow/SimulatorStatus.h"
#include "src/ros/display/display.h"
#include "src/ros/request/session_messages.h"
#include "src/session/session.h"
#include "stream_recorder.h"

namespace contact_flow {
namespace ros_interface {

/// What the simulator tells the world: topics, and the bag that holds all of them. Messages are
/// made when they are told of, and wait for SendOff: what is due later is ready by
/// then. For one thread.
class SimulatorTopics {
 public:
  SimulatorTopics(ros::NodeHandle* node, const std::string& bag_directory,
                  std::size_t bag_split_size, bool publish_clock, const DisplayOptions& display,
                  std::shared_ptr<const SigningKey> key);

  void Clock(const ros::Time& stamp);
  /// Model and parameters in force, latched; from now on they are what is displayed.
  void Model(const std::shared_ptr<const Setup>& setup, const ros::Time& stamp);
  void Tell(SimulatorEpoch message, const ros::Time& stamp);
  void Tell(SimulatorInput message, const ros::Time& stamp);
  void Tell(SimulatorMark message, const ros::Time& stamp);
  void Tell(PredictionRequest message, const ros::Time& stamp);
  void Tell(OutcomePrediction message, const ros::Time& stamp);
  void Tell(SimulatorSettings message, const ros::Time& stamp);
  void Event(SimulatorEvent message, const ros::Time& stamp);
  /// Hybrid state and, of the same instant, rolling derivative.
  void State(Session* session, const ros::Time& stamp);
  /// joint_states, tf, markers, wrenches, and what sensors tell.
  void Show(Session* session, const ros::Time& stamp);
  /// On `status` and /diagnostics.
  void Status(SimulatorStatus message, const ros::Time& stamp);

  /// Publishes and records what was told, in its order.
  void SendOff();

  /// Begins with `start`, whose topics it fills in, and the model; an epoch is to follow, so that
  /// the bag can be verified by itself.
  std::string StartRecording(const std::string& name, const ros::Time& stamp,
                             const RecordingStart& start);
  /// The end of a recording, then what waits for the disk, which may be another thread's.
  void CloseRecording() { recorder_.Close(); }
  std::vector<std::string> FinishRecording() { return recorder_.Finish(); }

 private:
  template <class Message>
  void Send(const ros::Publisher& publisher, const ros::Time& stamp, Message message,
            bool latched = false);
  /// The same with the stamp in its header.
  template <class Message>
  void SendStamped(const ros::Publisher& publisher, const ros::Time& stamp, Message message,
                   bool latched = false);
  std::vector<std::function<void()>> outbox_;
  ros::NodeHandle node_;
  const DisplayOptions options_;
  StreamRecorder recorder_;
  BagConnections connections_;
  const std::shared_ptr<const SigningKey> key_;
  std::uint32_t epochs_ = 0, recorded_from_ = 0;  // the last epoch told, and the first recorded
  ros::Publisher clock_, model_, epoch_, input_, event_, state_, settings_;
  ros::Publisher mark_, tangents_, asked_, predicted_;
  ros::Publisher joints_, transforms_, static_transforms_, contacts_, terrain_;
  ros::Publisher status_, diagnostics_;
  ros::Publisher odometry_, imu_;
  std::map<std::string, ros::Publisher> wrenches_, link_wrenches_;
  std::unique_ptr<Display> display_;
  std::vector<std::string> constraints_, links_;
  std::string model_name_;
  boost::shared_ptr<const ModelDescription> last_model_;
};

}  // namespace ros_interface
}  // namespace contact_flow
