// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <dynamic_reconfigure/server.h>
#include <ros/ros.h>
#include <std_srvs/Empty.h>

#include <memory>
#include <vector>

#include "contact_flow/ApplyImpulse.h"
#include "contact_flow/GetSimulatorState.h"
#include "contact_flow/InputCommand.h"
#include "contact_flow/MarkInstant.h"
#include "contact_flow/PredictOutcome.h"
#include "contact_flow/SetInput.h"
#include "contact_flow/SetSimulatorParameters.h"
#include "contact_flow/SetSimulatorState.h"
#include "contact_flow/SimulatorConfig.h"
#include "contact_flow/StepSimulation.h"
#include "simulator.h"
#include "src/ros/service/work_pool.h"

namespace contact_flow {
namespace ros_interface {

/// The services and the input topic of the simulator. Handlers may run at once; each posts its
/// command to the simulation thread and answers what became of it.
class SimulatorServices {
 public:
  SimulatorServices(Simulator* simulator, const SimulatorParameters& parameters,
                    ros::NodeHandle* node, ros::NodeHandle* prompt_node, ros::NodeHandle* work_node,
                    WorkPool* pool);

 private:
  /// dynamic_reconfigure under ~simulator, as it takes the name set_parameters.
  void OfferSettings(const SimulatorParameters& parameters, ros::NodeHandle* node);
  using Empty = std_srvs::Empty;
  bool Pause(Empty::Request& in, Empty::Response& out);
  /// A failed call, with the reason, when the run has come to its end.
  bool Unpause(Empty::Request& in, Empty::Response& out);
  bool ResetSimulation(Empty::Request& in, Empty::Response& out);
  bool ResetWorld(Empty::Request& in, Empty::Response& out);
  bool Step(StepSimulation::Request& in, StepSimulation::Response& out);
  bool SetState(SetSimulatorState::Request& in, SetSimulatorState::Response& out);
  bool GetState(GetSimulatorState::Request& in, GetSimulatorState::Response& out);
  bool SetInputs(SetInput::Request& in, SetInput::Response& out);
  bool Push(ApplyImpulse::Request& in, ApplyImpulse::Response& out);
  bool SetParameters(SetSimulatorParameters::Request& in, SetSimulatorParameters::Response& out);
  bool Mark(MarkInstant::Request& in, MarkInstant::Response& out);
  bool PredictFrom(PredictOutcome::Request& in, PredictOutcome::Response& out);

  Simulator* simulator_;
  WorkPool* pool_;  // of predictions
  std::vector<ros::ServiceServer> servers_;
  ros::Subscriber input_;
  std::vector<ros::Subscriber> commands_;
  ros::WallTimer status_timer_;
  std::unique_ptr<dynamic_reconfigure::Server<SimulatorConfig>> settings_;
};

}  // namespace ros_interface
}  // namespace contact_flow
