// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <memory>
#include <vector>

#include "analysis_servers.h"
#include "contact_flow/CancelWork.h"
#include "contact_flow/CheckAssumptions.h"
#include "contact_flow/CompareBDerivative.h"
#include "contact_flow/ComputeBDerivative.h"
#include "contact_flow/DescribeModel.h"
#include "contact_flow/LinearizeTrajectory.h"
#include "contact_flow/SimulateTrajectory.h"
#include "contact_flow/StartRecording.h"
#include "contact_flow/StopRecording.h"
#include "parameters.h"
#include "src/ros/recording/outlet.h"
#include "src/ros/service/work_pool.h"
#include "src/ros/service/work_threads.h"
#include "src/ros/simulator/simulator_services.h"
#include "src/session/setup.h"

namespace contact_flow {
namespace ros_interface {

/// The services of the node. Handlers may run at once; every one answers, whatever is thrown.
class Node {
 public:
  /// Begins to answer.
  explicit Node(const NodeParameters& parameters);

  /// Model and options in force.
  const Setup& setup() const { return setup_; }

 private:
  bool Simulate(SimulateTrajectory::Request& in, SimulateTrajectory::Response& out);
  bool Differentiate(ComputeBDerivative::Request& in, ComputeBDerivative::Response& out);
  bool Compare(CompareBDerivative::Request& in, CompareBDerivative::Response& out);
  bool CheckAssumed(CheckAssumptions::Request& in, CheckAssumptions::Response& out);
  bool Linearized(LinearizeTrajectory::Request& in, LinearizeTrajectory::Response& out);
  bool Cancel(CancelWork::Request& in, CancelWork::Response& out);
  bool Describe(DescribeModel::Request& in, DescribeModel::Response& out);
  bool Start(StartRecording::Request& in, StartRecording::Response& out);
  bool Stop(StopRecording::Request& in, StopRecording::Response& out);
  template <class Response, class Record>
  void Compute(const char* service, Record* record);
  /// Records results, and the simulator beside it; returns both paths.
  std::vector<std::string> RecordTo(const std::string& name);

  Setup setup_;
  WorkPool pool_;
  ros::CallbackQueue work_queue_;    // of services that may take long
  ros::CallbackQueue prompt_queue_;  // of those that only hand something on
  ros::NodeHandle node_;             // of all else
  ros::NodeHandle work_node_, prompt_node_;
  Outlet outlet_;
  AnalysisServers analyses_;
  std::unique_ptr<Simulator> simulator_;
  std::unique_ptr<SimulatorServices> simulator_services_;
  std::vector<ros::ServiceServer> servers_;
  WorkThreads prompt_threads_, work_threads_;
};

}  // namespace ros_interface
}  // namespace contact_flow
