// SPDX-License-Identifier: BSD-3-Clause
#include "policy_answer.h"

#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/policy_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr double kReach = 0.1, kLongestReach = 10;  // [s]

/// As many numbers as names, or `standard` where they are left out.
Vector Resolve(const std::string& field, const std::vector<double>& numbers,
               const std::vector<std::string>& names, const Vector& standard) {
  if (numbers.empty()) return standard;
  CheckSize(field, numbers.size(), names.size(), names);
  CheckFinite(field, numbers);
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

TrackingWeights ResolveWeights(const MechanicalSystem& system, const PolicyRequest& request) {
  const SystemDescription& names = system.description();
  std::vector<std::string> state = names.velocities;
  for (const std::string& name : names.velocities) state.push_back("d/dt " + name);
  CheckWeights("state_weights", request.state_weights);
  CheckWeights("terminal_weights", request.terminal_weights);
  for (std::size_t k = 0; k < request.input_weights.size(); ++k) {
    if (request.input_weights[k] > 0) continue;
    throw std::invalid_argument("input_weights[" + std::to_string(k) + "] is " +
                                std::to_string(request.input_weights[k]) +
                                ", expected a number > 0");
  }
  TrackingWeights weights;
  weights.state =
      Resolve("state_weights", request.state_weights, state, Vector::Ones(2 * system.dof()));
  weights.input = Resolve("input_weights", request.input_weights, names.inputs,
                          Vector::Ones(system.num_inputs()));
  weights.terminal = Resolve("terminal_weights", request.terminal_weights, state, weights.state);
  return weights;
}

void ResolveBounds(const SystemDescription& names, const PolicyRequest& request,
                   TrackingPolicy* policy) {
  policy->lower = Resolve("lower", request.lower, names.inputs, {});
  policy->upper = Resolve("upper", request.upper, names.inputs, {});
  CheckPolicy(*policy);
}

}  // namespace

PolicyResult Answer(const Setup& setup, const PolicyRequest& request) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  const ResolvedRun run = ResolveRun(setup, request);
  const BDerivativeOptions options =
      ResolveOptions(setup.derivative_options, request.derivative_options);
  const TrackingWeights weights = ResolveWeights(system, request);
  const double reach = ResolveNumber("reach", request.reach, kReach, kLongestReach);
  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  PolicyResult result;
  result.outcome = static_cast<std::uint8_t>(trajectory.status.outcome);
  result.message = trajectory.status.message;
  WarnOfRun(trajectory, &result);
  if (!trajectory.status.ok()) return result;
  try {
    TrackingPolicy policy = MakePolicy(system, trajectory, run.input, reach, weights, options);
    ResolveBounds(system.description(), request, &policy);
    result.policy = ToMsg(policy);
  } catch (const NoPolicy& reason) {
    result.outcome = static_cast<std::uint8_t>(reason.status().outcome);
    result.message = reason.what();
  }
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
