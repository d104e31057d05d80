// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/simulator_topics.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <diagnostic_updater/DiagnosticStatusWrapper.h>
#include <geometry_msgs/WrenchStamped.h>
#include <rosgraph_msgs/Clock.h>
#include <sensor_msgs/JointState.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>

#include "contact_flow/ros/conversions.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr bool kLatch = true;

/// A name of a constraint as part of a topic: letters, digits and '_'.
std::string TopicName(std::string name) {
  for (char& c : name) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return name;
}

}  // namespace

SimulatorTopics::SimulatorTopics(ros::NodeHandle* node, const std::string& bag_directory,
                                 std::size_t bag_split_size, bool publish_clock,
                                 const DisplayOptions& display)
    : node_(*node), options_(display), recorder_(bag_directory, bag_split_size) {
  ros::NodeHandle outside;
  if (publish_clock) clock_ = outside.advertise<rosgraph_msgs::Clock>("/clock", 10);
  model_ = node_.advertise<ModelDescription>("online_model", 1, kLatch);
  epoch_ = node_.advertise<SimulatorEpoch>("epoch", 100, kLatch);
  input_ = node_.advertise<SimulatorInput>("input_taken", 1000);
  event_ = node_.advertise<SimulatorEvent>("events", 1000);
  state_ = node_.advertise<HybridState>("state", 1000, kLatch);
  tangents_ = node_.advertise<RollingTangents>("rolling_derivative", 1000);
  mark_ = node_.advertise<SimulatorMark>("mark_taken", 100);
  asked_ = node_.advertise<PredictionRequest>("prediction_asked", 100);
  predicted_ = node_.advertise<OutcomePrediction>("prediction", 100);
  joints_ = outside.advertise<sensor_msgs::JointState>("joint_states", 100, kLatch);
  transforms_ = outside.advertise<tf2_msgs::TFMessage>("/tf", 100);
  static_transforms_ = outside.advertise<tf2_msgs::TFMessage>("/tf_static", 100, kLatch);
  contacts_ = node_.advertise<visualization_msgs::MarkerArray>("contacts", 10, kLatch);
  terrain_ = node_.advertise<visualization_msgs::MarkerArray>("terrain", 1, kLatch);
  status_ = node_.advertise<SimulatorStatus>("status", 10, kLatch);
  diagnostics_ = outside.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
}

ros::Time SimulatorTopics::BagTime(const ros::Time& stamp) {
  bag_time_ = std::max(stamp, bag_time_ + ros::Duration(0, 1));
  return bag_time_;
}

template <class Message>
void SimulatorTopics::Send(const ros::Publisher& publisher, const ros::Time& stamp, Message message,
                           bool latched) {
  const auto shared = boost::make_shared<const Message>(std::move(message));
  outbox_.push_back([=] {
    if (recorder_.Recording()) {
      const ros::Time time = BagTime(stamp);
      recorder_.Write(time, MakeBagEntry<Message>(publisher.getTopic(), time,
                                                  ros::this_node::getName(), shared, latched));
    }
    publisher.publish(shared);
  });
}

template <class Message>
void SimulatorTopics::SendStamped(const ros::Publisher& publisher, const ros::Time& stamp,
                                  Message message, bool latched) {
  message.header.stamp = stamp;
  Send(publisher, stamp, std::move(message), latched);
}

void SimulatorTopics::SendOff() {
  for (const std::function<void()>& send : outbox_) send();
  outbox_.clear();
}

void SimulatorTopics::Clock(const ros::Time& stamp) {
  if (!clock_) return;
  rosgraph_msgs::Clock message;
  message.clock = stamp;
  outbox_.push_back([=] { clock_.publish(message); });  // not recorded: rosbag play makes one
}

void SimulatorTopics::Model(const std::shared_ptr<const Setup>& setup, const ros::Time& stamp) {
  robot_.reset();
  points_.reset();
  setup_ = setup;
  if (setup_->robot != nullptr) {
    robot_ =
        std::make_unique<RobotDisplay>(*setup_->robot, setup_->configuration.robot.urdf, options_);
    tf2_msgs::TFMessage transforms;
    transforms.transforms = robot_->StaticTransforms(stamp);
    if (!transforms.transforms.empty()) Send(static_transforms_, stamp, transforms, kLatch);
    Send(terrain_, stamp, robot_->Terrain(), kLatch);
  } else {
    points_ = std::make_unique<PointDisplay>(*setup_->system, options_);
  }
  for (const std::string& name : setup_->system->description().constraints) {
    ros::Publisher& publisher = wrenches_[name];
    if (publisher) continue;
    publisher = node_.advertise<geometry_msgs::WrenchStamped>("wrench/" + TopicName(name), 100);
  }
  ModelDescription message = ToMsg(*setup_);
  message.header.stamp = stamp;
  last_model_ = boost::make_shared<const ModelDescription>(message);
  Send(model_, stamp, message, kLatch);
}

void SimulatorTopics::Tell(SimulatorEpoch message, const ros::Time& stamp) {
  SendStamped(epoch_, stamp, std::move(message), kLatch);
}

void SimulatorTopics::Tell(SimulatorInput message, const ros::Time& stamp) {
  SendStamped(input_, stamp, std::move(message));
}

void SimulatorTopics::Tell(SimulatorMark message, const ros::Time& stamp) {
  SendStamped(mark_, stamp, std::move(message));
}

void SimulatorTopics::Tell(PredictionRequest message, const ros::Time& stamp) {
  SendStamped(asked_, stamp, std::move(message));
}

void SimulatorTopics::Tell(OutcomePrediction message, const ros::Time& stamp) {
  SendStamped(predicted_, stamp, std::move(message));
}

void SimulatorTopics::Event(SimulatorEvent message, const ros::Time& stamp) {
  SendStamped(event_, stamp, std::move(message));
}

void SimulatorTopics::State(Session* session, const ros::Time& stamp) {
  HybridState message = session->StateMsg();
  message.header.frame_id = options_.world_frame;
  SendStamped(state_, stamp, std::move(message), kLatch);
  if (const auto tangents = session->TangentsMsg()) SendStamped(tangents_, stamp, *tangents);
}

void SimulatorTopics::Display(Session* session, const ros::Time& stamp) {
  const Vector x = session->State(), force = session->Force();
  const ContactMode mode = session->mode();
  Send(joints_, stamp, robot_ ? robot_->Joints(x, stamp) : ToJointState(*setup_->system, x, stamp),
       kLatch);
  tf2_msgs::TFMessage transforms;
  transforms.transforms = robot_ ? robot_->Transforms(x, stamp) : points_->Transforms(x, stamp);
  if (!transforms.transforms.empty()) Send(transforms_, stamp, std::move(transforms));
  Send(contacts_, stamp,
       robot_ ? robot_->Contacts(x, mode, force, stamp) : points_->Contacts(x, mode, force, stamp),
       kLatch);
  const std::vector<geometry_msgs::Wrench> wrenches =
      robot_ ? robot_->ContactWrenches(x, force) : points_->ContactWrenches(x, force);
  const std::vector<std::string>& names = setup_->system->description().constraints;
  for (std::size_t i = 0; i < names.size(); ++i) {
    geometry_msgs::WrenchStamped message;
    message.header.frame_id = options_.world_frame;
    message.wrench = wrenches[i];
    SendStamped(wrenches_[names[i]], stamp, std::move(message));
  }
}

void SimulatorTopics::Status(SimulatorStatus message, const ros::Time& stamp) {
  diagnostic_updater::DiagnosticStatusWrapper status;
  using Level = diagnostic_msgs::DiagnosticStatus;
  status.name = ros::this_node::getName() + ": simulator";
  status.hardware_id = "none";
  const std::string error = recorder_.Error();
  if (message.outcome != 0) {
    status.summary(Level::ERROR, message.message);
  } else if (!error.empty()) {
    status.summary(Level::ERROR, "recording: " + error);
  } else if (message.overruns > 0 && message.lateness > 0.01) {
    status.summary(Level::WARN, "the clock cannot be followed");
  } else {
    status.summary(Level::OK, message.paused ? "paused" : "running");
  }
  status.add("simulated time [s]", message.t);
  status.add("real-time factor asked", message.real_time_factor);
  status.add("real-time factor achieved", message.achieved_factor);
  status.add("events", message.events);
  status.add("events per second", message.events_per_second);
  status.add("lateness, last second [s]", message.lateness);
  status.add("lateness, largest [s]", message.largest_lateness);
  status.add("overruns", message.overruns);
  status.add("late inputs", message.late_inputs);
  status.add("margin: approach speed [m/s]", message.margins.approach_speed);
  status.add("margin: release rate [N/s]", message.margins.release_rate);
  status.add("margin: gap [m]", message.margins.gap);
  status.add("margin: force [N]", message.margins.force);
  status.add("margin: event interval [s]", message.margins.event_interval);
  diagnostic_msgs::DiagnosticArray array;
  array.status.push_back(status);
  SendStamped(diagnostics_, stamp, std::move(array));
  SendStamped(status_, stamp, std::move(message), kLatch);
}

std::string SimulatorTopics::StartRecording(const std::string& name, const ros::Time& stamp) {
  const std::string topic = model_.getTopic(), caller = ros::this_node::getName();
  const auto model = last_model_;  // with the parameters of the first epoch
  return recorder_.Start(
      name, [=](const ros::Time& time) { return MakeBagEntry(topic, time, caller, model); },
      BagTime(stamp));
}

}  // namespace ros_interface
}  // namespace contact_flow
