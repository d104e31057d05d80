// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/outlet.h"

#include <algorithm>
#include <boost/date_time/posix_time/posix_time.hpp>
#include <cctype>
#include <utility>

#include "contact_flow/flow/status.h"
#include "contact_flow/ros/conversions.h"

namespace contact_flow {
namespace ros_interface {

Outlet::Outlet(ros::NodeHandle* node, const std::string& bag_directory,
               const ModelDescription& description, std::shared_ptr<const SigningKey> key)
    : connections_(ros::this_node::getName()),
      recorder_(bag_directory),
      key_(std::move(key)),
      description_(description) {
  constexpr bool kLatch = true;
  model_description_ = node->advertise<ModelDescription>("model_description", 1, kLatch);
  trajectory_ = node->advertise<ContactTrajectory>("trajectory", 10, kLatch);
  mode_sequence_ = node->advertise<ModeSequence>("mode_sequence", 10, kLatch);
  b_derivative_ = node->advertise<OutcomeDerivative>("b_derivative", 10, kLatch);
  description_.header.stamp = NextStamp();
  model_description_.publish(description_);
}

/// Now, but later than every stamp before, and never 0, which is what simulated time begins with.
ros::Time Outlet::NextStamp() {
  ros::Time now = ros::Time::now();
  if (now.isZero()) now.fromNSec(ros::WallTime::now().toNSec());
  last_stamp_ = std::max(now, last_stamp_ + ros::Duration(0, 1));
  return last_stamp_;
}

template <class Record>
ros::Time Outlet::Stamp(Record* record) {
  record->header.stamp = NextStamp();
  record->header.frame_id = kWorldFrame;
  record->result.header = record->header;
  return record->header.stamp;
}

template <class Message>
BagEntry Outlet::Entry(const std::string& topic, boost::shared_ptr<const Message> message) {
  return connections_.Entry(ros::names::resolve("~" + topic), std::move(message));
}

std::string Outlet::Write(std::uint8_t outcome, const ros::Time& stamp,
                          const std::vector<BagEntry>& entries) {
  // A run that was stopped half-way cannot be repeated, and nobody waits for its answer any more.
  if (!recorder_.Recording() || outcome == static_cast<int>(Outcome::kCancelled)) return "";
  last_stamp_ = recorder_.Write(entries, stamp);
  return recorder_.Path();
}

std::string Outlet::Deliver(SimulationRecord* record) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const ros::Time stamp = Stamp(record);
  const auto shared = boost::make_shared<const SimulationRecord>(*record);
  const boost::shared_ptr<const ContactTrajectory> result(shared, &shared->result);
  const auto modes = boost::make_shared<const ModeSequence>(ToModeSequence(*result));
  trajectory_.publish(result);
  mode_sequence_.publish(modes);
  return Write(result->outcome, stamp,
               {Entry("record/simulation", shared), Entry("trajectory", result),
                Entry("mode_sequence", modes)});
}

std::string Outlet::Deliver(DerivativeRecord* record) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const ros::Time stamp = Stamp(record);
  const auto shared = boost::make_shared<const DerivativeRecord>(*record);
  const boost::shared_ptr<const OutcomeDerivative> result(shared, &shared->result);
  b_derivative_.publish(result);
  return Write(result->outcome, stamp,
               {Entry("record/derivative", shared), Entry("b_derivative", result)});
}

template <class Record>
std::string Outlet::DeliverRecord(const std::string& name, Record* record) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const ros::Time stamp = Stamp(record);
  const auto shared = boost::make_shared<const Record>(*record);
  return Write(shared->result.outcome, stamp, {Entry("record/" + name, shared)});
}

std::string Outlet::Deliver(ComparisonRecord* record) {
  return DeliverRecord("comparison", record);
}

std::string Outlet::Deliver(AssumptionRecord* record) {
  return DeliverRecord("assumptions", record);
}

std::string Outlet::Deliver(LinearizationRecord* record) {
  return DeliverRecord("linearization", record);
}

std::string Outlet::Deliver(PoincareRecord* record) {
  return DeliverRecord("poincare_map", record);
}

std::string Outlet::Deliver(StabilityRecord* record) { return DeliverRecord("stability", record); }

std::string Outlet::Deliver(ControllabilityRecord* record) {
  return DeliverRecord("controllability", record);
}

std::string Outlet::Deliver(CovarianceRecord* record) {
  return DeliverRecord("covariance", record);
}

std::string Outlet::Deliver(PeriodicOrbitRecord* record) {
  return DeliverRecord("periodic_orbit", record);
}

std::string Outlet::Deliver(OptimizationRecord* record) {
  return DeliverRecord("optimization", record);
}

std::string Outlet::StartRecording(const std::string& asked) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const ros::Time stamp = NextStamp();
  std::string name = asked;
  if (name.empty()) {
    std::string time = boost::posix_time::to_iso_extended_string(stamp.toBoost());
    std::replace(time.begin(), time.end(), ':', '-');
    name = description_.name + "_" + time;
    for (char& letter : name) {  // a robot may be called anything
      const bool plain = std::isalnum(static_cast<unsigned char>(letter)) || letter == '-';
      if (!plain) letter = '_';
    }
  }
  const auto description = boost::make_shared<const ModelDescription>(description_);
  RecordingPlan plan("results", ros::this_node::getName(), &connections_);
  for (const char* role :
       {"model_description", "trajectory", "mode_sequence", "b_derivative", "record/simulation",
        "record/derivative", "record/comparison", "record/assumptions", "record/linearization",
        "record/poincare_map", "record/stability", "record/controllability", "record/covariance",
        "record/periodic_orbit", "record/optimization"}) {
    plan.start.roles.push_back(role);
    plan.start.topics.push_back(ros::names::resolve(std::string("~") + role));
  }
  plan.key = key_;
  plan.preamble = {Entry("model_description", description)};
  recorder_.Start(name, plan, stamp);
  return recorder_.Path();
}

Recorder::Summary Outlet::StopRecording() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return recorder_.Stop();
}

}  // namespace ros_interface
}  // namespace contact_flow
