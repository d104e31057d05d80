// SPDX-License-Identifier: BSD-3-Clause
#include "linearize_answer.h"

#include <stdexcept>

#include "contact_flow/derivative/linearization.h"
#include "contact_flow/flow/simulate.h"
#include "src/ros/message/conversions.h"
#include "src/ros/message/gate.h"
#include "src/ros/message/warnings.h"
#include "src/ros/request/request.h"

namespace contact_flow {
namespace ros_interface {
namespace {

LinearizedInterval IntervalMsg(const SystemDescription& names,
                               const IntervalLinearization& interval) {
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
  m.final_error = ToMsg(VectorRef(interval.derivative.trust.state_error));
  m.derivative_error = interval.derivative.trust.derivative_error;
  for (const EventMap& event : interval.derivative.events) {
    m.events.push_back(event.ActivatedConstraints().ToString(names.constraints));
  }
  if (interval.is_linear) return m;
  try {
    const PiecewiseLinearMap map = interval.derivative.Pieces();
    for (const LinearPiece& piece : map.pieces()) m.pieces.push_back(ToMsg(piece));
  } catch (const std::length_error& error) {
    m.outcome = static_cast<std::uint8_t>(Outcome::kTooManyPieces);
    m.message = error.what();
  } catch (const NotPiecewiseLinear& reason) {
    m.outcome = static_cast<std::uint8_t>(Outcome::kNotDifferentiable);
    m.message = reason.what();
  }
  return m;
}

}  // namespace

TrajectoryLinearization Answer(const Setup& setup, const LinearizationRequest& request) {
  CheckMessage(request);
  const MechanicalSystem& system = *setup.system;
  const SystemDescription& names = system.description();
  const ResolvedRun run = ResolveRun(setup, request);
  const BDerivativeOptions options =
      ResolveOptions(setup.derivative_options, request.derivative_options);
  const Trajectory trajectory = Simulate(system, run.x, run.input, run.duration, run.options);
  TrajectoryLinearization result;
  result.model = names.name;
  result.velocities = names.velocities;
  result.inputs = names.inputs;
  result.outcome = static_cast<std::uint8_t>(trajectory.status.outcome);
  result.message = trajectory.status.message;
  WarnOfRun(trajectory, &result);
  result.duration = run.duration;
  if (!trajectory.status.ok()) return result;
  for (const IntervalLinearization& interval : Linearize(system, trajectory, options)) {
    result.intervals.push_back(IntervalMsg(names, interval));
  }
  return result;
}

}  // namespace ros_interface
}  // namespace contact_flow
