// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/linearization.h"

#include "contact_flow/budget.h"
#include "contact_flow/derivative/start_cone.h"
#include "end_event.h"
#include "input_cluster.h"

namespace contact_flow {
namespace {

/// kOk where the first order of activations of every event has a selection.
Status FirstSelectionExists(const BDerivative& derivative) {
  if (const Status together = derivative.Together(); !together.ok()) return together;
  if (!derivative.start.PiecewiseLinear().ok()) return derivative.start.PiecewiseLinear();
  for (const EventMap& event : derivative.events) {
    const Status linear = event.PiecewiseLinear(event.activated());
    if (!linear.ok()) return linear;
  }
  return {};
}

/// The selection that the first order of activations of every event gives [2d × 2d+m].
Matrix FirstSelection(const BDerivative& derivative) {
  const StartStop& stop = derivative.start_stop;
  Matrix product =
      stop.Empty() ? derivative.arcs.front() : Matrix(derivative.arcs.front() * stop.matrix());
  for (std::size_t k = 0; k < derivative.events.size(); ++k) {
    const EventMap& event = derivative.events[k];
    product = derivative.arcs[k + 1] * (event.Selection(event.activated()) * product);
  }
  return product.topRows(derivative.time.size());
}

/// Where a contact begins to slip from rest, tangents to the other side have another map.
bool BeginsToSlip(const MechanicalSystem& system, const Arc& arc, const Trajectory& trajectory) {
  if (arc.mode.SlippingInPlane().Empty()) return false;
  ContactDynamics dynamics(system, arc.u);
  return !StartCone(&dynamics, arc.x_begin, arc.mode, arc.t_begin, trajectory.gap_tolerance,
                    trajectory.speed_tolerance, trajectory.impact_law)
              .Empty();
}

}  // namespace

std::vector<IntervalLinearization> Linearize(const MechanicalSystem& system,
                                             const Trajectory& trajectory,
                                             BDerivativeOptions options, const InputCones& cones) {
  options.variables = {true, {}};
  const int tangents = 2 * system.dof();
  BudgetStage stage("the intervals of the input");
  std::vector<IntervalLinearization> intervals;
  const InputClusters clusters(system, trajectory);
  std::size_t first = 0;
  for (std::size_t last = 0; last < trajectory.arcs.size(); ++last) {
    const bool ends =
        last + 1 == trajectory.arcs.size() || trajectory.transitions[last].changes_input;
    if (!ends) continue;
    IntervalLinearization interval;
    interval.t_begin = trajectory.arcs[first].t_begin;
    interval.t_end = trajectory.arcs[last].t_end;
    interval.x_begin = trajectory.arcs[first].x_begin;
    interval.x_end = trajectory.arcs[last].x_end;
    std::size_t until = last;
    if (last < trajectory.transitions.size()) {
      // Events at its end are all in this interval: the arcs among them have no length.
      const InputCluster* at = clusters.At(last);
      if (at != nullptr && at->first == last) until = last + 1;
      if (at != nullptr) interval.x_end = trajectory.arcs[at->last + 1].x_begin;
    }
    const InputCluster* around = clusters.Around(first);
    if (around != nullptr) interval.x_begin = trajectory.arcs[around->last + 1].x_begin;
    interval.derivative = DifferentiateArcs(system, trajectory, first, until, options, cones);
    ConstraintSet switches;
    if (last + 1 == trajectory.arcs.size() && interval.derivative.status.ok()) {
      interval.derivative.status =
          CheckEnd(system, trajectory, interval.derivative.trust.state_error, &switches);
    }
    interval.status = interval.derivative.status;
    if (interval.status.ok()) interval.status = FirstSelectionExists(interval.derivative);
    if (interval.status.ok()) {
      const Matrix selection = FirstSelection(interval.derivative);
      interval.A = selection.leftCols(tangents);
      interval.B = selection.rightCols(selection.cols() - tangents);
      interval.is_linear = interval.derivative.IsDifferentiable() && switches.Empty() &&
                           !BeginsToSlip(system, trajectory.arcs[first], trajectory);
    }
    intervals.push_back(std::move(interval));
    AskBudget();
    stage.Next();
    first = last + 1;
  }
  return intervals;
}

}  // namespace contact_flow
