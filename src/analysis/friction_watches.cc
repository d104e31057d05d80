// SPDX-License-Identifier: BSD-3-Clause
// Where the guards of a run with friction are least, for its radius of validity.
#include <algorithm>
#include <cmath>

#include "contact_flow/derivative/variation.h"
#include "departures.h"
#include "friction_validity.h"
#include "resolved_instants.h"

namespace contact_flow {
namespace {

/// Forces below this part of the largest are zero, and rates below it of their terms: where an
/// event of guards was located, and elsewhere.
constexpr double kZero = 1e-7, kZeroElsewhere = 1e-10;
/// A slip that no event of its own ends or begins is known to so many absolute tolerances.
constexpr double kKnownSlip = 10;
/// Of a piece, down to rounding.
constexpr int kConeBisections = 45;

/// The part of Dh F that the sum of its terms leaves.
bool Moves(const WatchedGuards::Values& at, Eigen::Index guard, bool located = true) {
  const double terms = at.gradient.row(guard).cwiseAbs().dot(at.field.cwiseAbs());
  return std::abs(at.rate(guard)) > (located ? kZero : kZeroElsewhere) * terms;
}

}  // namespace

double FrictionValidity::ZeroOf(const WatchedGuards::Guard& guard, const WatchedGuards::Values& at,
                                bool located) const {
  if (guard.limit == Limit::kGap) return trajectory_.gap_tolerance;
  if (guard.limit != Limit::kSlip) return (located ? kZero : kZeroElsewhere) * at.force;
  const double known = kKnownSlip * trajectory_.absolute_tolerance;
  return located ? trajectory_.speed_tolerance : std::min(trajectory_.speed_tolerance, known);
}

/// Whether arc k begins at an event of guards: not with the run, or where the input changes alone.
bool FrictionValidity::BeginsLocated(std::size_t k) const {
  if (k == 0) return false;
  const Transition& before = trajectory_.transitions[k - 1];
  return !before.changes_input || !before.guards.empty() ||
         (k > 1 && derivative_.events[k - 1].absorbed());
}

bool FrictionValidity::BeginsAtZero(std::size_t k, Eigen::Index guard) const {
  const Watched& of = arcs_[k];
  const WatchedGuards::Guard& at = of.guards->guards()[static_cast<std::size_t>(guard)];
  // A slip that begins, too.
  const bool stuck =
      k > 0 && trajectory_.transitions[k - 1].mode_before.LetterOf(at.constraint) == Letter::kStick;
  const bool located = BeginsLocated(k) || (at.limit == Limit::kSlip && stuck);
  return of.begin.value(guard) <= ZeroOf(at, of.begin, located);
}

bool FrictionValidity::EndsAtZero(std::size_t k, Eigen::Index guard) const {
  const Watched& of = arcs_[k];
  const WatchedGuards::Guard& at = of.guards->guards()[static_cast<std::size_t>(guard)];
  return of.end.value(guard) <= ZeroOf(at, of.end, false);
}

/// Whether a slip began at transition k because its force had reached the cone: its rate is zero.
bool FrictionValidity::BeganAtCone(std::size_t k, int slip) const {
  const std::vector<int>& guards = trajectory_.transitions[k].guards;
  const int i = slip < system_.num_constraints() ? -1 : Guards(system_).ConstraintOf(slip);
  if (i < 0 || trajectory_.transitions[k].mode_before.LetterOf(i) != Letter::kStick) return false;
  return std::any_of(guards.begin(), guards.end(),
                     [&](int guard) { return guard == slip || guard == slip + 1; });
}

/// Guards at the ends of the arc: forces begin anew behind an event, and at the next one guards of
/// others turn, jump, or the run ends. What lifts a contact from its begin on has to do so.
void FrictionValidity::WatchEnds(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  Watched& of = arcs_[k];
  const bool last = k + 1 == arcs_.size();
  const ConstraintSet bounced =
      k == 0 ? ConstraintSet::All(system_.num_constraints())
             : trajectory_.transitions[k - 1].activated | trajectory_.transitions[k - 1].switched;
  ConstraintSet leaving;
  for (const Departure& from : FindDepartures(of.dynamics.get(), trajectory_, derivative_, k)) {
    of.begins.push_back(
        {Limit::kReleaseRate, from.constraint, arc.t_begin, from.value, from.rate, from.gradient});
    leaving.Insert(from.constraint);
  }
  const std::vector<WatchedGuards::Guard>& guards = of.guards->guards();
  for (std::size_t g = 0; g < guards.size(); ++g) {
    const auto row = static_cast<Eigen::Index>(g);
    const auto& [number, constraint, limit] = guards[g];
    const bool is_gap = limit == Limit::kGap;
    if (!BeginsAtZero(k, row)) {
      of.begins.push_back({limit, constraint, arc.t_begin, of.begin.value(row), of.begin.rate(row),
                           of.begin.gradient.row(row)});
    } else if (of.begin.rate(row) > 0 && Moves(of.begin, row, BeginsLocated(k)) &&
               !(is_gap && (bounced.Contains(constraint) || leaving.Contains(constraint))) &&
               !(k > 0 && BeganAtCone(k - 1, number))) {
      of.growing.push_back(row);
    }
    if (!last) {
      const Transition& transition = trajectory_.transitions[k];
      const auto& triggers = transition.guards;
      const bool named = std::find(triggers.begin(), triggers.end(), number) != triggers.end();
      const bool touches = is_gap && (transition.activated | transition.switched |
                                      transition.touching | transition.implied)
                                         .Contains(constraint);
      if (named || touches) {
        if (of.end.rate(row) < 0 && Moves(of.end, row)) of.vanishing.push_back(row);
        continue;
      }
    }
    // What is zero there stays so, but for what is about to cross it.
    const bool crosses = last && of.end.rate(row) < 0 && Moves(of.end, row);
    if (EndsAtZero(k, row) && !crosses) continue;
    of.ends.push_back({last ? Limit::kHorizon : limit, constraint, arc.t_end, of.end.value(row),
                       of.end.rate(row), of.end.gradient.row(row)});
  }
}

/// Minima of guards inside the arc, roots of their rates.
void FrictionValidity::WatchDips(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  Watched& of = arcs_[k];
  const std::vector<WatchedGuards::Guard>& guards = of.guards->guards();
  Vector x = arc.x_begin;
  const auto at = [&](double t) {
    arc.dense.Evaluate(t, x.data());
    return of.guards->At(x);
  };
  std::vector<bool> risen(guards.size());
  for (std::size_t g = 0; g < guards.size(); ++g) {
    risen[g] = !BeginsAtZero(k, static_cast<Eigen::Index>(g));
  }
  WatchedGuards::Values before = of.begin;
  double left = arc.t_begin;
  const auto look = [&](double right) {
    const WatchedGuards::Values behind = at(right);
    for (std::size_t g = 0; g < guards.size(); ++g) {
      const auto row = static_cast<Eigen::Index>(g);
      if (risen[g] && before.rate(row) < 0 && behind.rate(row) >= 0) {
        double low = left, high = right;
        for (int i = 0; i < kConeBisections; ++i) {
          const double middle = low + (high - low) / 2;
          (at(middle).rate(row) < 0 ? low : high) = middle;
        }
        const WatchedGuards::Values least = at(high);
        Arc begin = arc;
        begin.t_end = high;
        begin.x_end = x;
        const Matrix propagator =
            PropagateArc(of.dynamics.get(), begin, derivative_.options.tolerance);
        of.dips.push_back({guards[g].limit, guards[g].constraint, high, least.value(row), 0,
                           least.gradient.row(row) * propagator});
      }
      risen[g] = risen[g] || behind.rate(row) > 0;
    }
    before = behind;
    left = right;
  };
  const auto sample = [&](double t) {
    const WatchedGuards::Values values = at(t);
    GuardSample guard{values.value, values.rate, Vector(values.value.size())};
    for (std::size_t g = 0; g < guards.size(); ++g) {
      guard.zero(static_cast<Eigen::Index>(g)) = ZeroOf(guards[g], values, true);
    }
    return guard;
  };
  if (arc.dense.Empty()) return;
  for (const double instant : ResolvedInstants(arc, sample)) look(instant);
}

}  // namespace contact_flow
