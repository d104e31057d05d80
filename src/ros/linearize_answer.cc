// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/ros/linearize_answer.h"

#include <stdexcept>

#include "contact_flow/derivative/linearization.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/ros/conversions.h"
#include "contact_flow/ros/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

/// Most intervals one request may ask for.
constexpr std::size_t kMaxIntervals = 10000;

InputSchedule ResolveSchedule(const LinearizeTrajectory::Request& request, const Vector& nominal) {
  InputSchedule schedule;
  schedule.grid = request.grid.empty() ? std::vector<double>{0.0} : request.grid;
  const std::size_t count = schedule.grid.size(), m = static_cast<std::size_t>(nominal.size());
  if (count > kMaxIntervals) {
    throw std::invalid_argument("grid has " + std::to_string(count) + " instants, at most " +
                                std::to_string(kMaxIntervals) + " are accepted");
  }
  if (schedule.grid.front() != 0) {
    throw std::invalid_argument("grid[0] is " + std::to_string(schedule.grid.front()) +
                                " s, expected 0");
  }
  schedule.values.assign(count, nominal);
  const std::vector<double>& data = request.inputs.data;
  if (data.empty()) return schedule;
  CheckFinite("inputs.data", data);
  if (data.size() != count * m) {
    throw std::invalid_argument("inputs.data has " + std::to_string(data.size()) +
                                " entries, expected " + std::to_string(count) + " instants × " +
                                std::to_string(m) + " inputs");
  }
  for (std::size_t k = 0; k < count; ++k) {
    schedule.values[k] = Eigen::Map<const Vector>(data.data() + k * m, nominal.size());
  }
  return schedule;
}

LinearizedInterval IntervalMsg(const SystemDescription& names, const IntervalLinearization& interval) {
  LinearizedInterval m;
  m.t_begin = interval.t_begin;
  m.t_end = interval.t_end;
  const auto nq = static_cast<Eigen::Index>(names.coordinates.size());
  m.q = ToMsg(VectorRef(interval.x_begin.head(nq)));
  m.v = ToMsg(VectorRef(interval.x_begin.tail(interval.x_begin.size() - nq)));
  m.outcome = static_cast<std::uint8_t>(interval.status.outcome);
  m.message = interval.status.message;
  m.is_linear = interval.is_linear;
  if (!interval.status.ok()) return m;
  m.A = ToMsg(MatrixRef(interval.A));
  m.B = ToMsg(MatrixRef(interval.B));
  for (const EventMap& event : interval.derivative.events) {
    ContactMode activated;
    for (int i : event.activated()) activated.Insert(i);
    m.events.push_back(activated.ToString(names.constraints));
  }
  if (interval.is_linear) return m;
  try {
    const PiecewiseLinearMap map = interval.derivative.Pieces();
    for (const LinearPiece& piece : map.pieces()) m.pieces.push_back(ToMsg(piece));
  } catch (const std::length_error& error) {
    m.outcome = static_cast<std::uint8_t>(Outcome::kTooManyPieces);
    m.message = error.what();
  }
  return m;
}

}  // namespace

void Answer(const Setup& setup, const LinearizeTrajectory::Request& request,
            LinearizeTrajectory::Response* response) {
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const Run run = ResolveRun(setup, request.duration, request.state, {}, request.options);
  const BDerivativeOptions options =
      ResolveOptions(setup.derivative_options, request.derivative_options);
  const Trajectory trajectory =
      Simulate(system, run.x, ResolveSchedule(request, run.u), run.duration, run.options);
  response->outcome = static_cast<std::uint8_t>(trajectory.status.outcome);
  response->message = trajectory.status.message;
  response->velocities = names.velocities;
  response->inputs_names = names.inputs;
  if (!trajectory.status.ok()) return;
  for (const IntervalLinearization& interval : Linearize(system, trajectory, options)) {
    response->intervals.push_back(IntervalMsg(names, interval));
  }
}

}  // namespace ros_interface
}  // namespace contact_flow
