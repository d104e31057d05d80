// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <std_srvs/Empty.h>

#include <functional>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "contact_flow/CancelWork.h"
#include "contact_flow/CheckAssumptions.h"
#include "contact_flow/CompareBDerivative.h"
#include "contact_flow/ComputeBDerivative.h"
#include "contact_flow/ComputeCovariance.h"
#include "contact_flow/ComputeGradient.h"
#include "contact_flow/ComputePoincareMap.h"
#include "contact_flow/DecideControllability.h"
#include "contact_flow/DecideStability.h"
#include "contact_flow/DescribeModel.h"
#include "contact_flow/FindStabilizingFeedback.h"
#include "contact_flow/GetSimulatorState.h"
#include "contact_flow/LinearizeTrajectory.h"
#include "contact_flow/MakePolicy.h"
#include "contact_flow/MarkInstant.h"
#include "contact_flow/PredictOutcome.h"
#include "contact_flow/SimulateTrajectory.h"
#include "contact_flow/StartRecording.h"
#include "contact_flow/StepSimulation.h"
#include "contact_flow/StopRecording.h"
#include "src/ros/message/serialize.h"
#include "test/fuzz/request_seeds.h"

/// Hostile requests of every service as they travel, for a node at the other end of a connection.
namespace contact_flow {
namespace fuzz {

struct HostileRequest {
  ros_if::Bytes bytes;
  std::vector<std::string> changed;  ///< fields, as "state.q"
};

/// A service, and how it is asked.
struct WireKind {
  std::string service, md5sum;
  unsigned weight;                  ///< how often, relative to others
  std::vector<std::string> fields;  ///< names of those of a request, at any depth
  std::function<HostileRequest(const RequestSeeds&, std::mt19937*)> make;
};

/// The names of all fields of a message and of its parts.
inline std::vector<std::string> AllFieldNames(const char* definition) {
  std::vector<std::string> names;
  std::istringstream lines(definition);
  std::string part;
  const auto add = [&] {
    for (std::string& name : ros_if::FieldNames(part.c_str())) names.push_back(std::move(name));
    part.clear();
  };
  for (std::string line; std::getline(lines, line);) {
    if (line.compare(0, 4, "====") == 0) {
      add();
    } else if (line.compare(0, 5, "MSG: ") != 0) {
      part += line + "\n";
    }
  }
  add();
  return names;
}

/// Good requests …
template <class Request>
void FillWire(const RequestSeeds& seeds, MessageMutator* dice, Request* request) {
  seeds.Fill(dice, request);
}
inline void FillWire(const RequestSeeds& seeds, MessageMutator* dice,
                     MarkInstant::Request* request) {
  seeds.AddDirections(dice, request);
}
inline void FillWire(const RequestSeeds& seeds, MessageMutator* dice,
                     PredictOutcome::Request* request) {
  seeds.AddDirections(dice, request);
  request->horizon = kDuration;
}
inline void FillWire(const RequestSeeds&, MessageMutator*, StepSimulation::Request* request) {
  request->seconds = 0.01;
}
inline void FillWire(const RequestSeeds&, MessageMutator*, DescribeModel::Request* request) {
  request->model = "puck";
}
inline void FillWire(const RequestSeeds&, MessageMutator*, CancelWork::Request* request) {
  request->service = "compare";
}
inline void FillWire(const RequestSeeds&, MessageMutator*, StartRecording::Request*) {}
inline void FillWire(const RequestSeeds&, MessageMutator*, StopRecording::Request*) {}
inline void FillWire(const RequestSeeds&, MessageMutator*, GetSimulatorState::Request*) {}
inline void FillWire(const RequestSeeds&, MessageMutator*, std_srvs::Empty::Request*) {}

/// … and what they may ask for at most: of time the node's budget. A campaign cancels nobody's
/// requests, and goes through simulated time in small steps.
inline SimulationOptions* OptionsIn(StabilityRequest* request) {
  return &request->return_map.options;
}
inline SimulationOptions* OptionsIn(StepFeedbackRequest* request) {
  return &request->return_map.options;
}
template <class Request>
auto OptionsIn(Request* request) -> decltype(&request->options) {
  return &request->options;
}
template <class Request>
auto Restrict(Request* request) -> decltype(void(OptionsIn(request))) {
  Shorten(request);
  double& seconds = OptionsIn(request)->max_seconds;
  if (seconds > 0 && seconds <= kMaxSeconds) seconds = 0;
}
inline void Restrict(CancelWork::Request* request) { request->ask_only = true; }
inline void Restrict(StepSimulation::Request* request) {
  if (request->seconds <= 1e6) request->seconds = std::min(request->seconds, 0.02);
  if (request->seconds == 0) request->events = std::min(request->events, 3u);
}
inline void Restrict(...) {}

/// Messages `Request` to `Service`, which has fields of the same types.
template <class Service, class Request = typename Service::Request>
WireKind Kind(const char* service, unsigned weight) {
  WireKind kind;
  kind.service = service;
  kind.md5sum = ros::service_traits::MD5Sum<Service>::value();
  kind.weight = weight;
  kind.fields = AllFieldNames(ros::message_traits::Definition<Request>::value());
  kind.make = [](const RequestSeeds& seeds, std::mt19937* generator) {
    MessageMutator dice(generator, seeds.words);
    Request request;
    FillWire(seeds, &dice, &request);
    dice.Mutate(&request);
    Restrict(&request);
    return HostileRequest{ros_if::Serialize(request), dice.changed()};
  };
  return kind;
}

/// All services of a node with a simulator but those of recordings. What takes longer is asked
/// more rarely.
inline std::vector<WireKind> WireKinds() {
  return {Kind<SimulateTrajectory, SimulationRequest>("simulate", 8),
          Kind<ComputeBDerivative, DerivativeRequest>("b_derivative", 8),
          Kind<CompareBDerivative, ComparisonRequest>("compare", 2),
          Kind<CheckAssumptions, AssumptionRequest>("check_assumptions", 2),
          Kind<LinearizeTrajectory, LinearizationRequest>("linearize", 4),
          Kind<ComputePoincareMap, PoincareRequest>("poincare_map", 4),
          Kind<DecideStability, StabilityRequest>("assess_stability", 4),
          Kind<FindStabilizingFeedback, StepFeedbackRequest>("find_stabilizing_feedback", 2),
          Kind<DecideControllability, ControllabilityRequest>("assess_controllability", 4),
          Kind<ComputeCovariance, CovarianceRequest>("propagate_covariance", 4),
          Kind<ComputeGradient, GradientRequest>("gradient", 4),
          Kind<MakePolicy, PolicyRequest>("make_policy", 4),
          Kind<PredictOutcome>("predict", 4),
          Kind<SetSimulatorState>("set_state", 8),
          Kind<SetSimulatorParameters>("set_parameters", 8),
          Kind<ApplyImpulse>("apply_impulse", 8),
          Kind<SetInput>("set_input", 8),
          Kind<MarkInstant>("mark", 6),
          Kind<StepSimulation>("step", 4),
          Kind<GetSimulatorState>("get_state", 2),
          Kind<DescribeModel>("describe_model", 3),
          Kind<CancelWork>("cancel", 2),
          Kind<std_srvs::Empty>("pause_physics", 4),
          Kind<std_srvs::Empty>("unpause_physics", 1),
          Kind<std_srvs::Empty>("reset_simulation", 4),
          Kind<std_srvs::Empty>("reset_world", 1)};
}

}  // namespace fuzz
}  // namespace contact_flow
