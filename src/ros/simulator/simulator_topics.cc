// SPDX-License-Identifier: BSD-3-Clause
#include "simulator_topics.h"

#include <rosgraph_msgs/Clock.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <utility>

#include "src/ros/message/conversions.h"
#include "src/ros/request/model_description.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr bool kLatch = true;

}  // namespace

SimulatorTopics::SimulatorTopics(ros::NodeHandle* node, const std::string& bag_directory,
                                 std::size_t bag_split_size, bool publish_clock,
                                 const DisplayOptions& display,
                                 std::shared_ptr<const SigningKey> key)
    : node_(*node),
      options_(display),
      recorder_(bag_directory, bag_split_size),
      connections_(ros::this_node::getName()),
      key_(std::move(key)) {
  ros::NodeHandle outside;
  if (publish_clock) clock_ = outside.advertise<rosgraph_msgs::Clock>("/clock", 10);
  model_ = node_.advertise<ModelDescription>("online_model", 1, kLatch);
  epoch_ = node_.advertise<SimulatorEpoch>("epoch", 100, kLatch);
  settings_ = node_.advertise<SimulatorSettings>("settings", 10, kLatch);
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
  odometry_ = outside.advertise<nav_msgs::Odometry>("odom", 100);
  imu_ = outside.advertise<sensor_msgs::Imu>("imu", 100);
  contacts_ = node_.advertise<visualization_msgs::MarkerArray>("contacts", 10, kLatch);
  terrain_ = node_.advertise<visualization_msgs::MarkerArray>("terrain", 1, kLatch);
  status_ = node_.advertise<SimulatorStatus>("status", 10, kLatch);
  diagnostics_ = outside.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10);
}

template <class Message>
void SimulatorTopics::Send(const ros::Publisher& publisher, const ros::Time& stamp, Message message,
                           bool latched) {
  const auto shared = boost::make_shared<const Message>(std::move(message));
  outbox_.push_back([=] {
    recorder_.Write(stamp, connections_.Entry(publisher.getTopic(), shared, latched));
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
  display_ = std::make_unique<Display>(setup, options_);
  constraints_ = setup->system->description().constraints;
  if (display_->has_terrain()) {
    tf2_msgs::TFMessage transforms = display_->Static(stamp);
    if (!transforms.transforms.empty()) Send(static_transforms_, stamp, transforms, kLatch);
    Send(terrain_, stamp, display_->Terrain(), kLatch);
  }
  for (const std::string& name : constraints_) {
    ros::Publisher& publisher = wrenches_[name];
    if (publisher) continue;
    publisher = node_.advertise<geometry_msgs::WrenchStamped>("wrench/" + TopicName(name), 100);
  }
  links_ = display_->touching_links();
  model_name_ = setup->system->description().name;
  for (const std::string& name : links_) {
    ros::Publisher& publisher = link_wrenches_[name];
    if (publisher) continue;
    publisher =
        node_.advertise<geometry_msgs::WrenchStamped>("link_wrench/" + TopicName(name), 100);
  }
  ModelDescription message = ToMsg(*setup);
  message.header.stamp = stamp;
  last_model_ = boost::make_shared<const ModelDescription>(message);
  Send(model_, stamp, message, kLatch);
}

void SimulatorTopics::Tell(SimulatorEpoch message, const ros::Time& stamp) {
  epochs_ = message.epoch;
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
  if (message.epoch >= recorded_from_) return SendStamped(predicted_, stamp, std::move(message));
  message.header.stamp = stamp;  // asked for before the recording: nothing to compare it with
  outbox_.push_back([=] { predicted_.publish(message); });
}

void SimulatorTopics::Tell(SimulatorSettings message, const ros::Time& stamp) {
  SendStamped(settings_, stamp, std::move(message), kLatch);
}

void SimulatorTopics::Event(SimulatorEvent message, const ros::Time& stamp) {
  SendStamped(event_, stamp, std::move(message));
}

void SimulatorTopics::State(Session* session, const ros::Time& stamp) {
  HybridState message = StateOf(session);
  message.header.frame_id = options_.world_frame;
  SendStamped(state_, stamp, std::move(message), kLatch);
  if (const auto reading = session->ReadMark()) {
    SendStamped(tangents_, stamp,
                ToMsg(session->setup()->system->description(), *reading, session->epoch()));
  }
}

void SimulatorTopics::Show(Session* session, const ros::Time& stamp) {
  Display::OfState shown = display_->Show(session->Now(), stamp);
  Send(joints_, stamp, std::move(shown.joints), kLatch);
  if (!shown.transforms.transforms.empty()) Send(transforms_, stamp, std::move(shown.transforms));
  Send(contacts_, stamp, std::move(shown.contacts), kLatch);
  for (std::size_t i = 0; i < constraints_.size(); ++i) {
    Send(wrenches_[constraints_[i]], stamp, std::move(shown.wrenches[i]));
  }
  for (std::size_t i = 0; i < links_.size(); ++i) {
    Send(link_wrenches_[links_[i]], stamp, std::move(shown.link_wrenches[i]));
  }
  for (nav_msgs::Odometry& odometry : shown.odometry) Send(odometry_, stamp, std::move(odometry));
  for (sensor_msgs::Imu& imu : shown.imu) Send(imu_, stamp, std::move(imu));
}

void SimulatorTopics::Status(SimulatorStatus message, const ros::Time& stamp) {
  message.header.stamp = stamp;
  Send(diagnostics_, stamp,
       ToDiagnostics(message, ros::this_node::getName(), model_name_, recorder_.Error()));
  Send(status_, stamp, std::move(message), kLatch);
}

std::string SimulatorTopics::StartRecording(const std::string& name, const ros::Time& stamp,
                                            const RecordingStart& start) {
  RecordingPlan plan("online", ros::this_node::getName(), &connections_);
  const RecordingStart own = plan.start;
  plan.start = start;
  plan.start.kind = own.kind;
  plan.start.node = own.node;
  plan.start.version = own.version;
  const auto add = [&](const std::string& role, const ros::Publisher& publisher) {
    plan.start.roles.push_back(role);
    plan.start.topics.push_back(publisher.getTopic());
  };
  add("online_model", model_);
  add("epoch", epoch_);
  add("input_taken", input_);
  add("events", event_);
  add("state", state_);
  add("settings", settings_);
  add("rolling_derivative", tangents_);
  add("mark_taken", mark_);
  add("prediction_asked", asked_);
  add("prediction", predicted_);
  add("joint_states", joints_);
  add("tf", transforms_);
  add("tf_static", static_transforms_);
  add("contacts", contacts_);
  add("terrain", terrain_);
  add("status", status_);
  add("diagnostics", diagnostics_);
  add("odom", odometry_);
  add("imu", imu_);
  for (const auto& [constraint, publisher] : wrenches_) add("wrench/" + constraint, publisher);
  for (const auto& [link, publisher] : link_wrenches_) add("link_wrench/" + link, publisher);
  plan.key = key_;
  plan.preamble = {connections_.Entry(model_.getTopic(), last_model_)};
  const std::string path = recorder_.Start(name, plan, stamp);
  recorded_from_ = epochs_ + (epochs_ > 0 ? 1 : 0);
  return path;
}

}  // namespace ros_interface
}  // namespace contact_flow
