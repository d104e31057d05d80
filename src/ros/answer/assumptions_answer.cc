// SPDX-License-Identifier: BSD-3-Clause
#include "assumptions_answer.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/analysis/assumptions.h"
#include "contact_flow/analysis/force_jumps.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/event_map.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

constexpr int kMaxRegionSamples = 10000;
constexpr double kHalfWidth = 0.1;

ContactAssumptions ToAssumptions(const Names& constraints, double t,
                                 const AssumptionReport& report) {
  ContactAssumptions m;
  m.t = t;
  m.touching = report.touching.Names(constraints);
  m.smooth = report.smooth;
  m.mass_condition = report.mass_condition;
  m.rank = static_cast<std::uint32_t>(report.rank);
  m.condition = report.condition;
  m.qualified = report.qualified;
  m.contact_class = ContactClassName(report.contact_class);
  for (const Coupling& coupling : report.couplings) {
    PairCoupling pair;
    pair.first = constraints[static_cast<std::size_t>(coupling.first)];
    pair.second = constraints[static_cast<std::size_t>(coupling.second)];
    pair.smallest = pair.largest = coupling.value;
    pair.met = 1;
    pair.contact_class = m.contact_class;
    m.couplings.push_back(pair);
  }
  return m;
}

void AddForceJumps(const Names& constraints, const ForceJumpReport& report, ContactAssumptions* m) {
  if (!report.computed) {
    m->selections = "not computed";
    return;
  }
  m->selections = report.smooth() ? "smooth" : "first order only";
  for (const ForceJump& jump : report.contacts) {
    ContactForceJump entry;
    entry.constraint = constraints[static_cast<std::size_t>(jump.constraint)];
    entry.fate = ForceFateName(jump.fate);
    for (const StageForce& stage : jump.stages) {
      entry.stages.emplace_back();
      entry.stages.back().names = stage.activated.Names(constraints);
      entry.forces.push_back(stage.force);
    }
    m->force_jumps.push_back(entry);
  }
}

/// The sentence about contacts whose force decides nothing, or decides twice, to first order.
std::string Caveat(const Names& constraints, double t, const ForceJumpReport& report) {
  std::string contacts;
  for (const ForceJump& jump : report.contacts) {
    if (jump.fate != ForceFate::kRegained && jump.fate != ForceFate::kNearZero) continue;
    contacts += (contacts.empty() ? "'" : ", '") +
                constraints[static_cast<std::size_t>(jump.constraint)] + "' is " +
                ForceFateName(jump.fate);
  }
  if (contacts.empty()) return "";
  std::ostringstream text;
  text << "between the impacts at t = " << t << " s the force of " << contacts
       << ": the first-order value stands, the C1 hypothesis of that selection does not";
  return text.str();
}

/// Half widths of one part of the box: as asked, or the default for each coordinate.
std::vector<double> HalfWidths(const std::string& field, const std::vector<double>& asked,
                               const Names& coordinates) {
  if (asked.empty()) return std::vector<double>(coordinates.size(), kHalfWidth);
  CheckSize(field, asked.size(), coordinates.size(), coordinates);
  CheckFinite(field, asked);
  for (std::size_t i = 0; i < asked.size(); ++i) {
    if (asked[i] < 0) {
      throw std::invalid_argument(field + "[" + std::to_string(i) + "] is " +
                                  std::to_string(asked[i]) + ", expected a half width >= 0");
    }
  }
  return asked;
}

void AddRegion(const Setup& setup, const ResolvedRun& run, const AssumptionRequest& request,
               TrajectoryAssumptions* result) {
  const SystemDescription& names = setup.system->description();
  const int samples = ResolveCount("region_samples", request.region_samples, 0, kMaxRegionSamples);
  std::vector<double> half_width = HalfWidths("region_q", request.region_q, names.velocities);
  const std::vector<double> rates = HalfWidths("region_v", request.region_v, names.velocities);
  half_width.insert(half_width.end(), rates.begin(), rates.end());
  if (samples == 0) return;
  const RegionReport region = AssessRegion(
      *setup.system, run.x, run.input.values.front(),
      Eigen::Map<const Vector>(half_width.data(), static_cast<Eigen::Index>(half_width.size())),
      samples);
  result->region_smooth = static_cast<std::uint32_t>(region.smooth);
  result->region_mass_condition = region.largest_mass_condition;
  for (const PairInRegion& met : region.pairs) {
    PairCoupling pair;
    pair.first = names.constraints[static_cast<std::size_t>(met.first)];
    pair.second = names.constraints[static_cast<std::size_t>(met.second)];
    pair.smallest = met.smallest;
    pair.largest = met.largest;
    pair.met = static_cast<std::uint32_t>(met.met);
    pair.contact_class = met.met > 0 ? ContactClassName(met.worst) : "";
    result->region_pairs.push_back(pair);
  }
}

/// Whether of transitions k−1 and k one changes the input, and both happen at once.
bool CoincidesWithInput(const Trajectory& trajectory, std::size_t k) {
  const Transition &before = trajectory.transitions[k - 1], &next = trajectory.transitions[k];
  return before.changes_input != next.changes_input &&
         next.t - before.t <=
             std::max({trajectory.simultaneity_tolerance, before.tolerance, next.tolerance});
}

}  // namespace

TrajectoryAssumptions Answer(const Setup& setup, const AssumptionRequest& request) {
  CheckMessage(request);
  const ResolvedRun run = ResolveRun(setup, request);
  const MechanicalSystem& system = *setup.system;
  const Names& constraints = system.description().constraints;
  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  TrajectoryAssumptions result;
  result.model = system.description().name;
  result.constraints = constraints;
  result.outcome = static_cast<std::uint8_t>(trajectory.status.outcome);
  result.message = trajectory.status.message;
  WarnOfRun(trajectory, &result);
  result.duration = run.duration;
  result.margins = ToMsg(trajectory.margins);
  const Arc& first = trajectory.arcs.front();
  result.initial =
      ToAssumptions(constraints, 0, AssessAssumptions(system, run.x, first.u, first.mode));
  result.initial.selections = "smooth";  // nothing happens there
  const auto dynamics = std::make_shared<ContactDynamics>(system, first.u);
  const std::vector<AssumptionReport> reports = AssessTransitions(system, trajectory);
  result.differentiable = trajectory.status.ok();
  for (std::size_t k = 0; k < reports.size(); ++k) {
    const Transition& transition = trajectory.transitions[k];
    result.transitions.push_back(ToAssumptions(constraints, transition.t, reports[k]));
    const ForceJumpReport forces = AssessForceJumps(system, trajectory.arcs[k].u, transition);
    AddForceJumps(constraints, forces, &result.transitions.back());
    dynamics->SetInput(trajectory.arcs[k].u);
    // What b_derivative asks, too.
    Status status = CheckTransition(transition);
    double& defect = result.transitions.back().modularity_defect;
    defect = std::numeric_limits<double>::quiet_NaN();
    if (status.ok()) {
      const EventMap event(dynamics, transition);
      status = event.status();
      defect = event.AssessModularity().defect;
    }
    if (!status.ok()) {
      Warn(MakeWarning(static_cast<std::uint8_t>(status.outcome), status.message, transition.t),
           &result);
    }
    if (status.ok() && k > 0 && CoincidesWithInput(trajectory, k)) {
      defect = std::numeric_limits<double>::quiet_NaN();
      Warn(MakeWarning(ResultWarning::FIRST_ORDER_ONLY,
                       "an event coincides with a change of the input: the outcome has a piece for "
                       "each of their orders, which b_derivative gives",
                       transition.t),
           &result);
    }
    const std::string caveat = Caveat(constraints, transition.t, forces);
    if (!caveat.empty()) {
      Warn(MakeWarning(ResultWarning::FIRST_ORDER_ONLY, caveat, transition.t), &result);
    }
    result.differentiable = result.differentiable && status.ok();
  }
  AddRegion(setup, run, request, &result);
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
