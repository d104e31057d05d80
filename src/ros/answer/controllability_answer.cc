// SPDX-License-Identifier: BSD-3-Clause
#include "controllability_answer.h"

#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/DecideControllability.h"
#include "contact_flow/analysis/input_map.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/piecewise_linear/controllability.h"
#include "contact_flow/piecewise_linear/section.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/analysis_messages.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

using ControllabilityCodes = DecideControllability::Response;

static_assert(ControllabilityCodes::CONTROLLABLE ==
                      static_cast<int>(ControllabilityVerdict::kControllable) &&
                  ControllabilityCodes::NOT_CONTROLLABLE ==
                      static_cast<int>(ControllabilityVerdict::kNotControllable) &&
                  ControllabilityCodes::UNDETERMINED ==
                      static_cast<int>(ControllabilityVerdict::kUndetermined),
              "the constants of the service are the verdicts");

constexpr int kMaxSize = 256;  // inputs in all, or states
constexpr double kLargestRankTolerance = 0.1;

/// Rows of the tangents (δq, δv) that are to be reached, and their names.
std::vector<int> ResolveReached(const SystemDescription& names,
                                const std::vector<std::string>& asked,
                                std::vector<std::string>* labels) {
  std::vector<std::string> all = names.velocities;
  for (const std::string& velocity : names.velocities) all.push_back("d/dt " + velocity);
  *labels = asked.empty() ? all : asked;
  std::vector<int> rows;
  for (std::size_t k = 0; k < labels->size(); ++k) {
    rows.push_back(
        NameIndex("reached[" + std::to_string(k) + "]", "coordinate", (*labels)[k], all));
  }
  return rows;
}

std::vector<std::string> InputLabels(const SystemDescription& names, const InputSchedule& input) {
  std::vector<std::string> labels;
  for (double t : input.grid) {
    for (const std::string& name : names.inputs) {
      std::ostringstream label;
      label << "input " << name << " at " << t << " s";
      labels.push_back(label.str());
    }
  }
  return labels;
}

/// The map that is asked about; false, with the reason in the result, when there is none.
bool FindInputMap(const Setup& setup, const ControllabilityRequest& request,
                  PiecewiseLinearMap* map, ControllabilityResult* result) {
  if (!request.map.empty()) {
    *map = ToMap("map", request.map);
    return true;
  }
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  if (names.inputs.empty()) {
    throw std::invalid_argument("model '" + names.name + "' has no inputs");
  }
  const ResolvedRun run = ResolveRun(setup, request.duration, request.state, request.input,
                                     request.input_grid, request.options);
  const BDerivativeOptions options =
      ResolveOptions(setup.derivative_options, request.derivative_options);
  const std::vector<int> rows = ResolveReached(names, request.reached, &result->reached);
  result->inputs = InputLabels(names, run.input);
  if (result->inputs.size() > static_cast<std::size_t>(kMaxSize)) {
    throw std::invalid_argument("input_grid makes " + std::to_string(result->inputs.size()) +
                                " inputs, at most " + std::to_string(kMaxSize) + " are accepted");
  }
  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  result->message = trajectory.status.message;
  WarnOfRun(trajectory, result);
  if (!trajectory.status.ok()) return false;
  const std::vector<IntervalLinearization> intervals = Linearize(system, trajectory, options);
  for (const IntervalLinearization& interval : intervals) {
    if (interval.status.ok()) continue;
    result->message = interval.status.message;
    return false;
  }
  Matrix select = Matrix::Zero(2 * system.dof(), static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) select(rows[k], static_cast<Eigen::Index>(k)) = 1;
  const PiecewiseLinearMap whole = InputMap(intervals, options.max_pieces);
  *map = InBases(whole, select, Matrix::Identity(whole.cols(), whole.cols()));
  return true;
}

}  // namespace

ControllabilityResult Answer(const Setup& setup, const ControllabilityRequest& request) {
  CheckMessage(request);
  ControllabilityResult result;
  result.model = setup.system->description().name;
  result.outcome = ControllabilityCodes::NO_MAP;
  ControllabilityOptions options;
  options.rank_tolerance = ResolveNumber("rank_tolerance", request.rank_tolerance,
                                         options.rank_tolerance, kLargestRankTolerance);
  options.cancelled = setup.options.cancelled;
  options.consistency = ResolveConsistency(request.map_tolerance, request.max_linear_programs,
                                           !request.map.empty(), setup);
  PiecewiseLinearMap map;
  try {
    if (!FindInputMap(setup, request, &map, &result)) return result;
  } catch (const std::length_error& limit) {
    result.message = limit.what();
    return result;
  }
  if (map.rows() > kMaxSize || map.cols() > kMaxSize) {
    throw std::invalid_argument("map is " + std::to_string(map.rows()) + " × " +
                                std::to_string(map.cols()) + ", at most " +
                                std::to_string(kMaxSize) + " are accepted");
  }
  result.map = ToMsg(map);
  const MapConsistency consistency = CheckMap(map, !request.map.empty(), &options.consistency);
  if (consistency.defect == MapDefect::kUndecided) {
    Warn(MakeWarning(ResultWarning::MAP_UNCHECKED, consistency.message), &result);
  }
  if (!consistency.usable) {
    result.outcome = ControllabilityCodes::UNDETERMINED;
    result.message = "undetermined: " + consistency.message;
    return result;
  }
  const std::string warnings = result.message;
  const ControllabilityReport report = AssessControllability(map, options);
  result.outcome = static_cast<std::uint8_t>(report.verdict);
  result.message = report.message;
  AddNote(warnings, &result.message);
  result.reachable = ToMsg(MatrixRef(report.reachable));
  result.restriction = ToMsg(MatrixRef(report.restriction));
  result.pieces = static_cast<std::uint32_t>(report.pieces);
  result.coherently_oriented = report.coherently_oriented;
  result.smallest_singular_ratio = report.smallest_singular_ratio;
  result.degree = report.degree;
  result.preimages = report.preimages;
  result.homeomorphism = report.homeomorphism;
  result.unattained = ToMsg(VectorRef(report.unattained));
  if (!report.twins.empty()) {
    Matrix twins(static_cast<Eigen::Index>(report.twins.size()), report.twins.front().size());
    for (Eigen::Index k = 0; k < twins.rows(); ++k) {
      twins.row(k) = report.twins[static_cast<std::size_t>(k)];
    }
    result.twins = ToMsg(MatrixRef(twins));
  }
  if (options.cancelled && options.cancelled()) result.outcome = kAnalysisCancelled;
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
