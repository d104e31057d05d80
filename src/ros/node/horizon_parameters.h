// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/io/configuration.h"
#include "src/ros/policy/horizon_solver.h"

namespace contact_flow {
namespace ros_interface {

/// The parameters ~horizon of policy_tracker: the reference of its policy is followed by solving
/// again and again.
struct HorizonParameters {
  /// model_file, model, parameters, options, derivative_options, or robot and robot_description, as
  /// of contact_flow_node
  Configuration configuration;
  int intervals = 20;    ///< of the policy's grid in a window
  double budget = 0.05;  ///< of one solve, by the clock [s]
  double lead = 0;       ///< from a state to when its solution begins [s]; left out: the budget
  double every = 0;      ///< from one solve to the next, at least [s]; left out: as soon as may be
  int max_iterations = 20;           ///< of one solve
  std::vector<double> effort;        ///< [m] as of OptimizeTrajectory; left out: 1
  std::vector<double> path_weights;  ///< [nq] of positions at the instants; left out: 1
  std::vector<double> weights;       ///< [nq+d] of the state at the end of a window; left out: 1
  std::vector<double> state_weights, input_weights, terminal_weights;  ///< as of make_policy
  double reach = 0.1;                                                  ///< as of make_policy [s]
};

/// Of the map `node`, that of `name`/horizon. Throws std::invalid_argument, naming the parameter,
/// for one that is not in order.
HorizonParameters ReadHorizonParameters(const YAML::Node& node, const std::string& name);

/// Who solves. In lockstep the clock ends no solve. Throws std::invalid_argument where the
/// parameters, the model and the policy do not fit.
std::unique_ptr<HorizonSolver> MakeSolver(const HorizonParameters& parameters,
                                          const TrackingPolicy& policy, bool lockstep);

}  // namespace ros_interface
}  // namespace contact_flow
