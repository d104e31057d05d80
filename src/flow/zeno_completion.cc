// SPDX-License-Identifier: BSD-3-Clause
// How a Flow meets bounces that accumulate: it stops, or completes them to rest.
#include <cmath>
#include <sstream>
#include <utility>

#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/flow/flow.h"
#include "contact_flow/model/driven.h"
#include "frictional_rest.h"
#include "guarded.h"
#include "src/dynamics/mode_selection.h"
#include "src/dynamics/plastic_impact.h"

namespace contact_flow {
namespace {

/// Bounces that accumulate come back within this many times what is left until then.
constexpr double kReturn = 3;

}  // namespace

/// When the impacts up to this transition accumulate [s], if they do: intervals that shrink
/// geometrically and have shrunk by the stated factor, the next one being known where its bounce
/// was made rest; or a bounce of an elastic contact that is too low to be resolved.
std::optional<double> Flow::Accumulation(const ResolvedTransition& resolved) {
  const ConstraintSet impacts =
      transition_.activated | (transition_.grazed - transition_.mode_before);
  if (impacts.Empty()) return std::nullopt;
  std::optional<double> accumulation = zeno_.Impact(impacts, t_);
  if (!Touch(zeno_.pattern())) accumulation.reset();
  if (!accumulation && resolved.rest_interval > 0) {
    accumulation = zeno_.ImpactTo(t_ + resolved.rest_interval);
  }
  for (int i : impacts - system_.compliant()) {
    if (!accumulation) accumulation = PredictRest(i);
  }
  return accumulation;
}

/// Whether all of them are where they would rest. What rocks is so now and then.
bool Flow::Touch(ConstraintSet contacts) {
  if (contacts.Empty()) return true;
  system_.Constraints(x_.head(system_.num_positions()), x_.tail(system_.dof()), &terms_);
  for (int i : contacts) {
    if (std::abs(terms_.gap(i)) > options_.gap_tolerance) return false;
  }
  return true;
}

/// The end of the bounces of elastic contact i [s] if the next no longer reaches the absolute
/// tolerance: under constant acceleration −b, from speed v on, it rises to v²/(2b) and all of them
/// take 2v/(b (1 − γ)).
std::optional<double> Flow::PredictRest(int i) {
  const double restitution = system_.restitution()(i);
  if (restitution <= 0 || restitution >= 1 || mode_.Contains(i)) return std::nullopt;
  const int d = system_.dof(), nq = system_.num_positions();
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(nq), x_.tail(d), &terms_);
  const double speed = terms_.jacobian.row(i).dot(x_.tail(d));
  const double back = -(terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i));
  if (speed < 0 || !(speed * speed <= 2 * back * options_.absolute_tolerance)) return std::nullopt;
  return t_ + (speed > 0 ? 2 * speed / (back * (1 - restitution)) : 0);
}

/// The contacts at the last impact that rest when its bounces have come to their end: those that
/// rest, and those that are back by then. What an impact lifts for longer is none of them.
ConstraintSet Flow::EndOfBounces() {
  const int d = system_.dof(), nq = system_.num_positions();
  const ConstraintSet rest = transition_.mode_after;
  const ConstraintSet touched =
      transition_.mode_before | transition_.activated | transition_.grazed | zeno_.pattern();
  dynamics_.Evaluate(x_, mode_);
  system_.Constraints(x_.head(nq), x_.tail(d), &terms_);
  ConstraintSet end = rest;
  for (int i : touched - rest) {
    const double speed = terms_.jacobian.row(i).dot(x_.tail(d));
    const double back = -(terms_.jacobian.row(i).dot(dynamics_.acceleration()) + terms_.bias(i));
    const bool returns = 2 * speed <= kReturn * (accumulation_time_ - t_) * back;
    if (speed <= options_.speed_tolerance || returns) end.Insert(i);
  }
  return end - system_.compliant();
}

/// Turns the last impact into rest of the contacts that the bounces end at, EndOfBounces: see
/// SimulateOptions::complete_zeno. False where the run is to stop instead.
bool Flow::CompleteZeno(ConstraintSet sticking) {
  Transition last = transition_;
  const int d = system_.dof(), nq = system_.num_positions();
  const InverseInertia inertia(system_, x_.head(nq), x_.tail(d));
  bool plastic = true;
  for (int i : last.activated | last.grazed) plastic = plastic && system_.restitution()(i) == 0;
  if (system_.HasFriction()) {
    const auto rest = RestOfBounces(&dynamics_, last, sticking, options_.gap_tolerance);
    if (!rest) return false;
    last.energy_lost += rest->energy_lost;
    if (!options_.complete_zeno && !plastic) return false;
    sticking = rest->closed;
    last.x_plus.tail(d) = rest->v_plus;
    last.mode_after = rest->mode;
  } else {
    ImpactResult impact;
    const Status stuck = Guarded(
        t_, [&] { impact = PlasticImpact(system_, x_.head(nq), last.x_minus.tail(d), sticking); });
    if (!stuck.ok()) return false;
    const double rest = KineticEnergy(inertia.mass(), impact.v_plus);
    // M-orthogonal to what sticks: |v|² − |v⁺|² seen from the surfaces, which may be driven.
    last.energy_lost += KineticEnergy(inertia.mass(), last.x_plus.tail(d) - impact.v_plus);
    if (!options_.complete_zeno && !(plastic && last.energy_lost < rest)) return false;
    last.x_plus.tail(d) = impact.v_plus;
    if (options_.complete_zeno) last.impulse = impact.impulse;
    const ConstraintSet pressed = last.mode_after & system_.compliant();
    status_ = Guarded(t_, [&] {
      const ModeSelection selection =
          SelectMode(&dynamics_, last.x_plus, sticking, {last.tolerance}, pressed);
      last.mode_after = selection.mode;
      last.implied = selection.implied;
    });
  }
  last.completes_zeno = true;
  last.released = last.mode_before - last.mode_after;
  transition_ = std::move(last);
  mode_ = transition_.mode_after;
  x_ = transition_.x_plus;
  std::ostringstream message;
  message.precision(12);
  message << "at t = " << t_ << " s impacts of "
          << sticking.ToString(system_.description().constraints) << " that accumulate at "
          << accumulation_time_ << " s are completed to sticking: " << transition_.energy_lost
          << " J are lost";
  Warn(Outcome::kZeno, message.str());
  return true;
}

}  // namespace contact_flow
