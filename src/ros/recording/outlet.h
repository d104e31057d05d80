// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/ros.h>

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "contact_flow/AssumptionRecord.h"
#include "contact_flow/ComparisonRecord.h"
#include "contact_flow/ControllabilityRecord.h"
#include "contact_flow/CovarianceRecord.h"
#include "contact_flow/DerivativeRecord.h"
#include "contact_flow/EnsembleRecord.h"
#include "contact_flow/GradientRecord.h"
#include "contact_flow/LinearizationRecord.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/OptimizationRecord.h"
#include "contact_flow/PeriodicOrbitRecord.h"
#include "contact_flow/PoincareRecord.h"
#include "contact_flow/PolicyRecord.h"
#include "contact_flow/SimulationRecord.h"
#include "contact_flow/StabilityRecord.h"
#include "contact_flow/StepFeedbackRecord.h"
#include "contact_flow/TrajectoryRecord.h"
#include "recorder.h"

namespace contact_flow {
namespace ros_interface {

/// Where results go, in the order of their stamps: first to the bag, then to the latched topics.
/// May be used by several threads at once: what they deliver while the disk is busy is written
/// together next.
class Outlet {
 public:
  /// Publishes the model on `model_description`, too.
  Outlet(ros::NodeHandle* node, const std::string& bag_directory,
         const ModelDescription& description, std::shared_ptr<const SigningKey> key = nullptr);
  ~Outlet();

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
  std::string Deliver(StepFeedbackRecord* record);
  std::string Deliver(ControllabilityRecord* record);
  std::string Deliver(CovarianceRecord* record);
  std::string Deliver(GradientRecord* record);
  std::string Deliver(PolicyRecord* record);
  std::string Deliver(PeriodicOrbitRecord* record);
  std::string Deliver(OptimizationRecord* record);
  std::string Deliver(TrajectoryRecord* record);
  std::string Deliver(EnsembleRecord* record);

  /// As Recorder; an empty name is made of the model and the time. Returns the path.
  std::string StartRecording(const std::string& name);
  Recorder::Summary StopRecording();

 private:
  ros::Time NextStamp();
  /// Something that the writer is to do; it is told under the mutex when it is done.
  struct Job {
    Recorder::Result result;
    std::function<void()> publish;  // behind it
    std::function<void()> other;    // instead of a result
    std::string path;
    std::exception_ptr error;
    bool done = false;
  };

  /// Stamps both, the record and its copy that is delivered.
  template <class Record>
  void Stamp(Record* record, Record* shared);
  /// With the mutex locked by the caller. Throws the job's error.
  void Wait(Job* job, std::unique_lock<std::mutex>* lock);
  std::string Hand(std::uint8_t outcome, Job* job, std::unique_lock<std::mutex>* lock);
  void Run();
  void Carry(const std::vector<Job*>& jobs);
  void WriteTogether(const std::vector<Job*>& jobs);
  /// A result that goes to the bag alone, on the topic "record/NAME".
  template <class Record>
  std::string DeliverRecord(const std::string& name, Record* record);
  template <class Message>
  BagEntry Entry(const std::string& topic, boost::shared_ptr<const Message> message);

  std::mutex mutex_;
  std::condition_variable asked_, done_;
  std::vector<Job*> jobs_;  // for the writer, in the order of their stamps
  bool recording_ = false;
  bool stopping_ = false;
  ros::Time last_stamp_;
  BagConnections connections_;
  Recorder recorder_;  // of the writer
  const std::shared_ptr<const SigningKey> key_;
  ModelDescription description_;
  ros::Publisher model_description_;
  ros::Publisher trajectory_;
  ros::Publisher mode_sequence_;
  ros::Publisher b_derivative_;
  ros::Publisher policy_;
  std::thread writer_;
};

}  // namespace ros_interface
}  // namespace contact_flow
