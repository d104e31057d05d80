// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/continued_outcomes.h"

#include <algorithm>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/event_map.h"
#include "contact_flow/dynamics/contact_dynamics.h"

namespace contact_flow {
namespace {

/// Velocities that differ by less than this, relative, are one outcome: sequences of impacts that
/// commute differ by rounding.
constexpr double kSameEnd = 1e-12;

bool Same(const OrderOutcome& a, const OrderOutcome& b) {
  const double scale = 1 + a.v_plus.cwiseAbs().maxCoeff();
  return a.mode_after == b.mode_after && a.status.outcome == b.status.outcome &&
         (a.v_plus - b.v_plus).cwiseAbs().maxCoeff() <= kSameEnd * scale;
}

/// The schedule as seen by a run that begins at time t.
InputSchedule From(const InputSchedule& schedule, double t) {
  InputSchedule rest = {{0.0}, {schedule.values.front()}};
  for (std::size_t k = 0; k < schedule.grid.size(); ++k) {
    if (schedule.grid[k] <= t) {
      rest.values.front() = schedule.values[k];
    } else {
      rest.grid.push_back(schedule.grid[k] - t);
      rest.values.push_back(schedule.values[k]);
    }
  }
  return rest;
}

/// Tells that the order decides again, later in the continuation.
Status LaterOrders(const MechanicalSystem& system, double t_begin, const Trajectory& run) {
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    Transition transition = run.transitions[k];
    transition.t += t_begin;
    if (transition.completes_zeno || transition.activated.Size() < 2) continue;
    const EventMap event(std::make_shared<ContactDynamics>(system, run.arcs[k].u), transition);
    if (event.status().outcome == Outcome::kDiscontinuous) return event.status();
  }
  return {};
}

ContinuedOutcome Continue(const MechanicalSystem& system, const InputSchedule& schedule,
                          const Transition& transition, const OrderOutcome& outcome, double t_end,
                          SimulateOptions options) {
  ContinuedOutcome result;
  result.status = outcome.status;
  if (!result.status.ok()) return result;
  const int d = system.dof(), nq = system.num_positions();
  Vector x(nq + d);
  x << transition.x_minus.head(nq), outcome.v_plus;
  ConstraintTerms terms;
  system.Constraints(x.head(nq), x.tail(d), &terms);
  for (int i : transition.mode_before | transition.activated) {
    if (system.compliant().Contains(i)) continue;
    options.gap_tolerance = std::max(options.gap_tolerance, 2 * std::abs(terms.gap(i)));
  }
  options.dense = false;
  options.impact_law = transition.impact_law;
  try {
    const Trajectory run = Simulate(system, x, From(schedule, transition.t),
                                    std::max(t_end - transition.t, 0.0), options);
    result.status = run.status;
    result.final_state = run.FinalState();
    result.modes = run.ModeSequence();
    if (result.status.ok()) result.status = LaterOrders(system, transition.t, run);
  } catch (const std::invalid_argument& refusal) {
    result.status = {Outcome::kNotDifferentiable, refusal.what()};
  }
  return result;
}

}  // namespace

std::vector<ContinuedOutcome> ContinueOutcomes(const MechanicalSystem& system,
                                               const InputSchedule& schedule,
                                               const Transition& transition,
                                               const std::vector<OrderOutcome>& outcomes,
                                               double t_end, const SimulateOptions& options) {
  BudgetStage stage("the continued outcomes of the orders", outcomes.size());
  std::vector<ContinuedOutcome> results;
  std::vector<std::size_t> different;  // first order of each
  for (std::size_t k = 0; k < outcomes.size(); ++k) {
    const auto known = std::find_if(different.begin(), different.end(), [&](std::size_t other) {
      return Same(outcomes[other], outcomes[k]);
    });
    if (known != different.end()) {
      results.push_back(results[*known]);
      continue;
    }
    if (static_cast<int>(different.size()) == kMaxContinuedOutcomes) {
      std::ostringstream message;
      message << "the cluster at t = " << transition.t << " s has more than "
              << kMaxContinuedOutcomes << " different outcomes: they are not continued";
      throw std::length_error(message.str());
    }
    AskBudget();
    different.push_back(k);
    results.push_back(Continue(system, schedule, transition, outcomes[k], t_end, options));
    AskBudget();
    stage.Next();
  }
  return results;
}

}  // namespace contact_flow
