// SPDX-License-Identifier: BSD-3-Clause
#include "horizon_parameters.h"

#include <limits>
#include <stdexcept>
#include <utility>

#include "contact_flow/io/map_reader.h"
#include "parameters.h"
#include "src/ros/message/gate.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr long kMostIntervals = 10000, kMostIterations = 100000;

/// As many numbers ≥ 0 as `size`, or ones where they are left out.
Vector Resolve(const std::string& field, const std::vector<double>& numbers, Eigen::Index size) {
  if (numbers.empty()) return Vector::Ones(size);
  if (numbers.size() != static_cast<std::size_t>(size)) {
    throw std::invalid_argument("horizon/" + field + " has " + std::to_string(numbers.size()) +
                                " entries, expected " + std::to_string(size));
  }
  CheckWeights("horizon/" + field, numbers);
  return Eigen::Map<const Vector>(numbers.data(), size);
}

void RequireSame(const char* what, const std::vector<std::string>& names,
                 const std::vector<std::string>& expected) {
  if (names == expected) return;
  throw std::invalid_argument(std::string("horizon: the ") + what +
                              " of its model are not those of the policy: it is of another model");
}

}  // namespace

HorizonParameters ReadHorizonParameters(const YAML::Node& node, const std::string& name) {
  HorizonParameters p;
  const std::string map = name + "/horizon";
  MapReader reader(node, map);
  p.configuration = ReadModelParameters(&reader, map);
  const auto read = [&](const char* key, double smallest, double largest, double* value) {
    reader.Read(key, value);
    if (reader.Has(key)) CheckWithin(map + "/" + key, *value, smallest, largest);
  };
  long intervals = p.intervals, iterations = p.max_iterations;
  reader.Read("intervals", &intervals, 1, kMostIntervals);
  reader.Read("max_iterations", &iterations, 0, kMostIterations);
  p.intervals = static_cast<int>(intervals);
  p.max_iterations = static_cast<int>(iterations);
  read("budget", 1e-6, 1e6, &p.budget);
  p.lead = p.budget;
  read("lead", 0, 1e6, &p.lead);
  read("every", 0, 1e6, &p.every);
  read("reach", 0, 10, &p.reach);
  reader.Read("effort", &p.effort);
  reader.Read("path_weights", &p.path_weights);
  reader.Read("weights", &p.weights);
  reader.Read("state_weights", &p.state_weights);
  reader.Read("input_weights", &p.input_weights);
  reader.Read("terminal_weights", &p.terminal_weights);
  reader.Finish();
  return p;
}

std::unique_ptr<HorizonSolver> MakeSolver(const HorizonParameters& parameters,
                                          const TrackingPolicy& policy, bool lockstep) {
  const Configuration& c = parameters.configuration;
  std::shared_ptr<const MechanicalSystem> system = MakeConfigured(c, c.parameters);
  const SystemDescription& names = system->description();
  RequireSame("coordinates", names.coordinates, policy.names.coordinates);
  RequireSame("velocities", names.velocities, policy.names.velocities);
  RequireSame("constraints", names.constraints, policy.names.constraints);
  RequireSame("inputs", names.inputs, policy.names.inputs);
  const Eigen::Index m = system->num_inputs(), nq = system->num_positions();
  HorizonProblem problem = FollowReference(
      policy, Resolve("effort", parameters.effort, m),
      Resolve("path_weights", parameters.path_weights, nq),
      Resolve("weights", parameters.weights, system->state_size()), parameters.intervals);
  const double apart = problem.whole.simulate.simultaneity_tolerance;
  problem.whole.simulate = c.options;
  if (c.options.simultaneity_tolerance == 0) problem.whole.simulate.simultaneity_tolerance = apart;
  problem.whole.derivative = c.derivative_options;
  CheckOptions(c.options);
  CheckOptions(c.derivative_options);
  HorizonOptions options;
  options.weights.state = Resolve("state_weights", parameters.state_weights, 2 * system->dof());
  options.weights.input = Resolve("input_weights", parameters.input_weights, m);
  options.weights.terminal =
      parameters.terminal_weights.empty()
          ? options.weights.state
          : Resolve("terminal_weights", parameters.terminal_weights, 2 * system->dof());
  if (!(options.weights.input.minCoeff() > 0)) {
    throw std::invalid_argument("horizon/input_weights must be > 0");
  }
  options.reach = parameters.reach;
  options.max_iterations = parameters.max_iterations;
  options.budget = lockstep ? std::numeric_limits<double>::infinity() : parameters.budget;
  const Unknowns checked(*system, problem.whole);  // throws for what does not fit
  return std::make_unique<HorizonSolver>(std::move(system), std::move(problem), std::move(options));
}

}  // namespace ros_interface
}  // namespace contact_flow
