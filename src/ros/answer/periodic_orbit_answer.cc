// SPDX-License-Identifier: BSD-3-Clause
#include "periodic_orbit_answer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "contact_flow/FindPeriodicOrbitResult.h"
#include "contact_flow/analysis/periodic_orbit.h"
#include "limits.h"
#include "poincare_answer.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using OrbitCodes = FindPeriodicOrbitResult;

static_assert(OrbitCodes::CONVERGED == static_cast<int>(NewtonStatus::kConverged) &&
                  OrbitCodes::STALLED == static_cast<int>(NewtonStatus::kStalled) &&
                  OrbitCodes::UNDEFINED == static_cast<int>(NewtonStatus::kUndefined) &&
                  OrbitCodes::MAX_ITERATIONS == static_cast<int>(NewtonStatus::kMaxIterations) &&
                  OrbitCodes::CANCELLED == static_cast<int>(NewtonStatus::kCancelled),
              "the constants of the action are the statuses");

const std::vector<std::string> kConditionKinds = {"period", "coordinate", "velocity", "touchdown",
                                                  "liftoff"};
constexpr double kLargestOrbitTolerance = 1;
constexpr int kMaxNewton = 10000, kMaxOccurrence = 1000;

OrbitCondition ResolveCondition(const SystemDescription& names, const std::string& field,
                                const OrbitRequirement& requirement) {
  OrbitCondition condition;
  condition.kind = static_cast<OrbitCondition::Kind>(
      NameIndex(field + ".kind", "kind", requirement.kind, kConditionKinds));
  CheckFinite(field + ".value", {requirement.value});
  condition.value = requirement.value;
  condition.occurrence =
      ResolveCount(field + ".occurrence", requirement.occurrence, 1, kMaxOccurrence);
  const std::string name = field + ".name";
  switch (condition.kind) {
    case OrbitCondition::Kind::kPeriod:
      break;
    case OrbitCondition::Kind::kCoordinate:
      condition.index = NameIndex(name, "coordinate", requirement.name, names.coordinates);
      break;
    case OrbitCondition::Kind::kVelocity:
      condition.index = NameIndex(name, "velocity", requirement.name, names.velocities);
      break;
    default:
      condition.index = NameIndex(name, "constraint", requirement.name, names.constraints);
      if (requirement.other.empty()) break;
      condition.other =
          NameIndex(field + ".other", "constraint", requirement.other, names.constraints);
  }
  return condition;
}

OrbitProblem ResolveProblem(const Setup& setup, const PeriodicOrbitRequest& request) {
  const SystemDescription& names = setup.system->description();
  const ResolvedRun run = ResolveRun(setup, 0, request.state, request.input, {}, {});
  OrbitProblem problem;
  problem.factory = [&setup](const ParameterValues& values) {
    return setup.WithParameters(values);
  };
  for (const Parameter& parameter : names.parameters) {
    problem.parameters[parameter.name] = parameter.value;
  }
  ParameterIndices(names, request.unknown_parameters);
  problem.unknown_parameters = request.unknown_parameters;
  if (!request.parameters.empty()) {
    CheckSize("parameters", request.parameters.size(), request.unknown_parameters.size(),
              request.unknown_parameters);
    CheckFinite("parameters", request.parameters);
  }
  for (std::size_t k = 0; k < request.parameters.size(); ++k) {
    problem.parameters[request.unknown_parameters[k]] = request.parameters[k];
  }
  problem.section = ResolveSection(*setup.system, "section", request.section);
  problem.x = run.x;
  problem.u = run.input.values.front();
  for (std::size_t k = 0; k < request.requirements.size(); ++k) {
    problem.conditions.push_back(ResolveCondition(names, "requirements[" + std::to_string(k) + "]",
                                                  request.requirements[k]));
  }
  return problem;
}

OrbitOptions ResolveOrbitOptions(const Setup& setup, const PeriodicOrbitRequest& request) {
  OrbitOptions options;
  PoincareOptions& poincare = options.poincare;
  poincare.simulate = ResolveOptions(TightOptions(setup), request.options);
  poincare.derivative = ResolveOptions(TightDerivativeOptions(setup), request.derivative_options);
  poincare.horizon = ResolveNumber("horizon", request.horizon, poincare.horizon, kMaxHorizon);
  CheckWithin("horizon", poincare.horizon, kMinHorizon, kMaxHorizon);
  poincare.shortest = ResolveNumber("shortest", request.shortest, poincare.shortest, kMaxHorizon);
  options.newton.tolerance = ResolveNumber("tolerance", request.tolerance, options.newton.tolerance,
                                           kLargestOrbitTolerance);
  options.newton.max_iterations = ResolveCount("max_iterations", request.max_iterations,
                                               options.newton.max_iterations, kMaxNewton);
  return options;
}

/// Share of the digits between the first residual and the tolerance that are gained.
double Fraction(double first, double now, double tolerance) {
  if (now <= tolerance) return 1;
  if (!(first > tolerance)) return 0;
  return std::clamp(std::log(first / now) / std::log(first / tolerance), 0.0, 1.0);
}

}  // namespace

PeriodicOrbitResult Answer(const Setup& setup, const PeriodicOrbitRequest& request,
                           const Watch& watch) {
  CheckMessage(request);
  const OrbitProblem problem = ResolveProblem(setup, request);
  OrbitOptions options = ResolveOrbitOptions(setup, request);
  const Matrix neutral = ResolveTranslation(*setup.system, request.translation);
  const auto cancelled = [&] {
    return watch.Cancelled() || (setup.options.cancelled && setup.options.cancelled());
  };
  options.poincare.simulate.cancelled = cancelled;
  double first = 0;
  options.newton.progress = [&](const NewtonIteration& iteration, const Vector& best) {
    if (iteration.iteration == 0) first = iteration.residual;
    if (watch.report) {
      watch.report(iteration.iteration,
                   Fraction(first, iteration.residual, options.newton.tolerance),
                   iteration.residual, best);
    }
    return !cancelled();
  };
  OrbitSolution found = FindOrbit(problem, options);
  const MechanicalSystem& system = *found.system;
  PeriodicOrbitResult result;
  result.model = system.description().name;
  result.outcome = cancelled() ? kAnalysisCancelled
                   : found.newton.status == NewtonStatus::kCancelled
                       ? EndOfSearch()
                       : static_cast<std::uint8_t>(found.newton.status);
  result.message = found.newton.message;
  for (const NewtonIteration& iteration : found.newton.iterations) {
    SolverIteration m;
    m.iteration = static_cast<std::uint32_t>(iteration.iteration);
    m.value = iteration.residual;
    m.step = iteration.step;
    m.method = iteration.iteration > 0 ? "Newton" : "";
    result.iterations.push_back(m);
  }
  result.q = ToMsg(VectorRef(found.x.head(system.num_positions())));
  result.v = ToMsg(VectorRef(found.x.tail(system.dof())));
  result.unknown_parameters = request.unknown_parameters;
  for (const std::string& name : request.unknown_parameters) {
    result.parameters.push_back(found.parameters.at(name));
  }
  result.residual = ToMsg(VectorRef(found.newton.residual));
  result.orbit = ToMsg(system, Reduce(system, found.x, std::move(found.orbit), neutral));
  Warn(result.orbit.warnings, &result);
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
