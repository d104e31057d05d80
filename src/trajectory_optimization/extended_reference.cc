// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/extended_reference.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

/// Length of a step of the continuation [s]: the method's error is 1e-13 for motions of 10 rad/s.
constexpr double kStep = 5e-4;

/// The interval of the grid that begins at or before t.
std::size_t IntervalAt(const std::vector<double>& grid, double t) {
  const auto next = std::upper_bound(grid.begin(), grid.end(), t);
  return next == grid.begin() ? 0 : static_cast<std::size_t>(next - grid.begin()) - 1;
}

}  // namespace

ExtendedReference::ExtendedReference(const MechanicalSystem& system, Trajectory run,
                                     InputSchedule inputs, double reach)
    : system_(system), run_(std::move(run)), inputs_(std::move(inputs)), reach_(reach) {
  if (!run_.status.ok()) {
    throw std::invalid_argument("the reference ended early: " + run_.status.message);
  }
  if (!(reach >= 0) || !std::isfinite(reach)) {
    throw std::invalid_argument("the reach of a reference must be finite and ≥ 0");
  }
  Validate(system, inputs_);
  ReferencePhase phase;
  const auto begin = [&phase](const Arc& arc) {
    phase = ReferencePhase();
    phase.mode = arc.mode;
    phase.t_begin = arc.t_begin;
    phase.x_begin = arc.x_begin;
  };
  begin(run_.arcs.front());
  for (std::size_t k = 0; k < run_.arcs.size(); ++k) {
    phase.t_end = run_.arcs[k].t_end;
    phase.x_end = run_.arcs[k].x_end;
    if (k == run_.transitions.size()) break;
    const Transition& event = run_.transitions[k];
    if (event.changes_input && event.mode_after == event.mode_before) continue;
    phase.activated = event.activated | event.switched;
    phase.released = event.released;
    phases_.push_back(phase);
    begin(run_.arcs[k + 1]);
  }
  phases_.push_back(phase);
}

int ExtendedReference::PhaseAt(double t) const {
  int phase = 0;
  while (phase + 1 < static_cast<int>(phases_.size()) &&
         t > phases_[static_cast<std::size_t>(phase)].t_end) {
    ++phase;
  }
  return phase;
}

const Vector& ExtendedReference::Input(double t) const {
  return inputs_.values[IntervalAt(inputs_.grid, t)];
}

Vector ExtendedReference::State(int number, double t) const {
  const ReferencePhase& phase = phases_.at(static_cast<std::size_t>(number));
  if (t <= phase.t_begin) {
    return Continued(phase, phase.x_begin, phase.t_begin, std::max(t, phase.t_begin - reach_));
  }
  if (t > phase.t_end) {
    return Continued(phase, phase.x_end, phase.t_end, std::min(t, phase.t_end + reach_));
  }
  return t == phase.t_end ? phase.x_end : run_.State(t);
}

/// By the method of Runge and Kutta, from one instant of the grid to the next.
Vector ExtendedReference::Continued(const ReferencePhase& phase, Vector x, double from,
                                    double to) const {
  const int d = system_.dof(), nq = system_.num_positions();
  double t = from;
  while (t != to) {
    // The grid's interval that is gone through from t on.
    std::size_t k = IntervalAt(inputs_.grid, t);
    double end = to;
    if (to > t) {
      if (k + 1 < inputs_.grid.size()) end = std::min(end, inputs_.grid[k + 1]);
    } else {
      if (k > 0 && t == inputs_.grid[k]) --k;
      if (k > 0) end = std::max(end, inputs_.grid[k]);
    }
    ContactDynamics dynamics(system_, inputs_.values[k]);
    const auto rate = [&](const Vector& at) {
      Vector xdot(nq + d);
      dynamics.Evaluate(at, phase.mode);
      system_.space().Rate(at.data(), at.data() + nq, xdot.data());
      xdot.tail(d) = dynamics.acceleration();
      return xdot;
    };
    const int steps = std::max(1, static_cast<int>(std::ceil(std::abs(end - t) / kStep)));
    const double h = (end - t) / steps;
    for (int i = 0; i < steps; ++i) {
      const Vector k1 = rate(x), k2 = rate(x + 0.5 * h * k1), k3 = rate(x + 0.5 * h * k2);
      const Vector k4 = rate(x + h * k3);
      x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    t = end;
  }
  return x;
}

}  // namespace contact_flow
