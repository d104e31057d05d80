// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <memory>
#include <mutex>
#include <string>

#include "contact_flow/AssumptionRecord.h"
#include "contact_flow/ComparisonRecord.h"
#include "contact_flow/ControllabilityRecord.h"
#include "contact_flow/CovarianceRecord.h"
#include "contact_flow/DerivativeRecord.h"
#include "contact_flow/LinearizationRecord.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/OptimizationRecord.h"
#include "contact_flow/PeriodicOrbitRecord.h"
#include "contact_flow/PoincareRecord.h"
#include "contact_flow/SimulationRecord.h"
#include "contact_flow/StabilityRecord.h"
#include "contact_flow/ros/recorder.h"

namespace contact_flow {
namespace ros_interface {

/// Where results go, one at a time and in the order of their stamps: first to the bag, then to the
/// latched topics. May be used by several threads at once.
class Outlet {
 public:
  /// Publishes the model on `model_description`, too.
  Outlet(ros::NodeHandle* node, const std::string& bag_directory,
         const ModelDescription& description, std::shared_ptr<const SigningKey> key = nullptr);

  /// Stamps the record, writes it to the bag if recording is on, publishes its result, and returns
  /// the path of the bag, or "". Throws std::runtime_error when the result could not be written; it
  /// is not published then.
  std::string Deliver(SimulationRecord* record);
  std::string Deliver(DerivativeRecord* record);
  std::string Deliver(ComparisonRecord* record);
  std::string Deliver(AssumptionRecord* record);
  std::string Deliver(LinearizationRecord* record);
  std::string Deliver(PoincareRecord* record);
  std::string Deliver(StabilityRecord* record);
  std::string Deliver(ControllabilityRecord* record);
  std::string Deliver(CovarianceRecord* record);
  std::string Deliver(PeriodicOrbitRecord* record);
  std::string Deliver(OptimizationRecord* record);

  /// As Recorder; an empty name is made of the model and the time. Returns the path.
  std::string StartRecording(const std::string& name);
  Recorder::Summary StopRecording();

 private:
  ros::Time NextStamp();
  template <class Record>
  ros::Time Stamp(Record* record);
  /// A result that goes to the bag alone, on the topic "record/NAME".
  template <class Record>
  std::string DeliverRecord(const std::string& name, Record* record);
  std::string Write(std::uint8_t outcome, const ros::Time& stamp,
                    const std::vector<BagEntry>& entries);
  template <class Message>
  BagEntry Entry(const std::string& topic, boost::shared_ptr<const Message> message);

  std::mutex mutex_;
  ros::Time last_stamp_;
  BagConnections connections_;
  Recorder recorder_;
  const std::shared_ptr<const SigningKey> key_;
  ModelDescription description_;
  ros::Publisher model_description_;
  ros::Publisher trajectory_;
  ros::Publisher mode_sequence_;
  ros::Publisher b_derivative_;
};

}  // namespace ros_interface
}  // namespace contact_flow
