// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/poincare.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "clock_rates.h"
#include "contact_flow/budget.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/piecewise_linear/section.h"
#include "section_crossing.h"
#include "tangent_map.h"

namespace contact_flow {
namespace {

constexpr int kFirstHorizon = 16;  // the horizon is tried in parts: 1/16, 1/8, …
constexpr int kMaxReturns = 8;
constexpr double kSettled = 1e-15;   // relative change of the time of return
constexpr double kSymmetric = 1e-9;  // how far a symmetry may be from one, relative

template <class... Parts>
std::string Text(const Parts&... parts) {
  std::ostringstream text;
  text.precision(9);
  (text << ... << parts);
  return text.str();
}

}  // namespace

const char* ReturnStatusName(ReturnStatus status) {
  constexpr const char* kNames[] = {"returned", "no return",     "stopped",
                                    "tangent",  "no derivative", "refused"};
  return kNames[static_cast<int>(status)];
}

PoincareMap::PoincareMap(const MechanicalSystem& system, const VectorRef& u, const Section& section,
                         const PoincareOptions& options)
    : system_(system), u_(u), section_(section), options_(options) {
  Validate(system, section);
  const int n = system.num_constraints();
  for (const WantedEvent& event : options.events) {
    if (event.constraint < 0 || event.constraint >= n || event.occurrence < 1) {
      throw std::invalid_argument(
          Text("there is no event ", event.occurrence, " of constraint number ", event.constraint));
    }
  }
  if (!(options.horizon > 0) || !std::isfinite(options.horizon) || !(options.shortest >= 0)) {
    throw std::invalid_argument(Text("horizon = ", options.horizon, " s and shortest = ",
                                     options.shortest, " s must be positive"));
  }
}

PoincareReturn PoincareMap::Return(const VectorRef& x, bool differentiate) const {
  const BudgetStage stage("the return");
  PoincareReturn result;
  try {
    if (section_.kind == Section::Kind::kTime) {
      result.time = section_.value;
      Settle(x, &result);
    } else {
      result.message = Text("the section was not crossed within ", options_.horizon, " s");
      double part = options_.horizon / kFirstHorizon;
      while (!FindReturn(x, part, &result) && result.status == ReturnStatus::kNoReturn &&
             part < options_.horizon) {
        AskBudget();
        // Of 5e-324 s the sixteenth part is 0.
        part = part > 0 ? std::min(2 * part, options_.horizon) : options_.horizon;
      }
    }
  } catch (const std::invalid_argument& refusal) {
    result.status = ReturnStatus::kRefused;
    result.message = refusal.what();
  }
  if (result.status != ReturnStatus::kReturned || !ApplySymmetry(x, &result)) return result;
  result.event_times =
      EventTimes(result.trajectory, LocateEvents(result.trajectory, options_.events));
  if (!differentiate) return result;
  result.start_basis = Basis(x, result.trajectory.arcs.front().mode);
  ContactMode end = result.trajectory.arcs.back().mode;
  if (!section_.symmetry.Empty()) {
    end =
        ImageOf(system_, u_, section_.symmetry, result.trajectory.FinalState(), end, result.x).mode;
  }
  result.end_basis = Basis(result.x, end);
  const Matrix clocks = RateRows(ClockRates(system_, result.trajectory), system_.dof());
  result.start_basis = Keeping(result.start_basis, clocks);
  result.end_basis = Keeping(result.end_basis, clocks);
  if (result.end_basis.cols() == result.start_basis.cols()) {
    result.end_basis = NearestBasis(result.end_basis, result.start_basis);
  }
  Differentiate(x, &result);
  return result;
}

/// From the first return to g of it; false where g is no symmetry there.
bool PoincareMap::ApplySymmetry(const VectorRef& x, PoincareReturn* result) const {
  const ReturnSymmetry& symmetry = section_.symmetry;
  if (symmetry.Empty()) return true;
  const Vector end = result->x;
  result->x = symmetry.Apply(system_, x, end);
  const SymmetryImage image =
      ImageOf(system_, u_, symmetry, end, result->trajectory.arcs.back().mode, result->x);
  result->symmetry_residual = image.residual;
  if (image.reason.empty() && image.residual <= kSymmetric) return true;
  result->status = ReturnStatus::kRefused;
  result->message =
      Text("the section's symmetry is none of the system at t = ", result->time, " s: ",
           image.reason.empty()
               ? Text("mass matrix, forces or contacts differ by ", image.residual, ", relative")
               : image.reason);
  return false;
}

/// Looks for the return in a run of that duration; true when there is one.
bool PoincareMap::FindReturn(const VectorRef& x, double duration, PoincareReturn* result) const {
  SimulateOptions options = options_.simulate;
  options.dense = true;
  Trajectory run = Simulate(system_, x, u_, duration, options);
  bool found = false;
  if (section_.kind == Section::Kind::kEvent) {
    const Status status = run.status;
    found = FindEvent(x, std::move(run), result);
    if (!found && !status.ok()) {
      result->status = ReturnStatus::kStopped;
      result->message = status.message;
    }
    return found;
  }
  found = FirstCrossing(system_, section_, run, options_.shortest, &result->time);
  if (found) {
    Settle(x, result);
  } else if (!run.status.ok()) {
    result->status = ReturnStatus::kStopped;
    result->message = run.status.message;
    result->trajectory = std::move(run);
  }
  return found;
}

/// Newton's method for the time of return, each step a run that ends there.
void PoincareMap::Settle(const VectorRef& x, PoincareReturn* result) const {
  SimulateOptions options = options_.simulate;
  options.dense = true;
  ContactDynamics dynamics(system_, u_);
  for (int k = 0; k < kMaxReturns; ++k) {
    result->trajectory = Simulate(system_, x, u_, result->time, options);
    if (!result->trajectory.status.ok()) {
      result->status = ReturnStatus::kStopped;
      result->message = result->trajectory.status.message;
      return;
    }
    result->x = result->trajectory.FinalState();
    if (section_.kind == Section::Kind::kTime) break;
    Vector gradient;
    const double height = Height(result->x, &gradient);
    const Vector field = dynamics.Field(result->x, result->trajectory.arcs.back().mode);
    result->crossing_speed = gradient.dot(field);
    if (!(std::abs(result->crossing_speed) > options.speed_tolerance)) {
      result->status = ReturnStatus::kTangent;
      result->message = Text("the section is touched at t = ", result->time,
                             " s: ds F = ", result->crossing_speed);
      return;
    }
    const double change = -height / result->crossing_speed;
    if (std::abs(change) <= kSettled * result->time) break;
    if (k + 1 < kMaxReturns) result->time += change;
  }
  result->status = ReturnStatus::kReturned;
  result->message.clear();
}

/// The first activation of the section's constraint; cuts the run there.
bool PoincareMap::FindEvent(const VectorRef& x, Trajectory run, PoincareReturn* result) const {
  const WantedEvent touchdown{section_.index};
  std::size_t k = 0;
  while (k < run.transitions.size() &&
         !(Happens(run.transitions[k], touchdown) && run.transitions[k].t >= options_.shortest)) {
    ++k;
  }
  // Behind the event there is an arc, unless the run ended at it.
  if (k >= run.transitions.size() || k + 1 >= run.arcs.size()) return false;
  run.transitions.resize(k + 1);
  run.arcs.resize(k + 2);
  const Transition& event = run.transitions.back();
  Arc& last = run.arcs.back();
  last.t_end = last.t_begin;
  last.x_end = last.x_begin;
  last.dense = DenseArc();
  result->time = event.t;
  result->x = event.x_plus;
  Vector gradient;
  Height(event.x_minus, &gradient);
  result->crossing_speed = gradient.head(system_.dof()).dot(event.x_minus.tail(system_.dof()));
  // Margins of what has happened so far.
  SimulateOptions options = options_.simulate;
  const double shorter = event.t - run.simultaneity_tolerance;
  run.status = {};
  if (shorter > 0) run.margins = Simulate(system_, x, u_, shorter, options).margins;
  run.margins.approach_speed =
      std::min(run.margins.approach_speed, std::abs(result->crossing_speed));
  run.margins.cluster_spread = std::max(run.margins.cluster_spread, event.spread);
  result->trajectory = std::move(run);
  result->status = ReturnStatus::kReturned;
  result->message.clear();
  return true;
}

}  // namespace contact_flow
