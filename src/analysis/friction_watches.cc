// SPDX-License-Identifier: BSD-3-Clause
// Where the guards of a run with friction are least, for its radius of validity.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "departures.h"
#include "friction_validity.h"
#include "propagator_along.h"
#include "resolved_instants.h"

namespace contact_flow {
namespace {

/// Forces below this part of the largest are zero, and rates below it of their terms: where an
/// event of guards was located, and elsewhere.
constexpr double kZero = 1e-7, kZeroElsewhere = 1e-10;
/// A slip that no event of its own ends or begins is known to so many absolute tolerances.
constexpr double kKnownSlip = 10;
/// What is no more than this part of a guard is no dip of it.
constexpr double kShallow = 1e-3;
/// Of a piece, down to rounding.
constexpr int kConeBisections = 45;

/// The part of Dh F that the sum of its terms leaves.
bool Moves(const WatchedGuards::Values& at, Eigen::Index guard, bool located = true) {
  const double terms = at.gradient.row(guard).cwiseAbs().dot(at.field.cwiseAbs());
  return std::abs(at.rate(guard)) > (located ? kZero : kZeroElsewhere) * terms;
}

/// Where the cubic with these values and rates at 0 and h turns, between rates of opposite signs.
double TurnOfCubic(double a, double rate_a, double b, double rate_b, double h) {
  const double sign = rate_a < 0 ? 1 : -1, c = sign * rate_a, fall = sign * (b - a) / h;
  const double bend = 3 * fall - 2 * c - sign * rate_b, cube = c + sign * rate_b - 2 * fall;
  const double s = -c / (bend + std::sqrt(std::max(0.0, bend * bend - 3 * cube * c)));
  return a + sign * h * s * (c + s * (bend + s * cube));
}

/// Looks at values one after the other for those that they fall to and rise from.
class ValleySearch {
 public:
  /// Whether the value is above the last lowest one by more than `least`, to which they had fallen
  /// by as much. `piece` is where its minimum is.
  bool Passes(double value, std::size_t piece, double least) {
    const bool passes = falls_ && value - low_ > least;
    if (passes) falls_ = false;
    if (passes || first_) high_ = value;
    if (!falls_ && high_ - value > least) {
      falls_ = true;
      low_ = std::numeric_limits<double>::infinity();
    }
    if (falls_ && value < low_) {
      low_ = value;
      lowest_ = piece;
    }
    high_ = std::max(high_, value);
    first_ = false;
    return passes;
  }
  std::size_t lowest() const { return lowest_; }

 private:
  bool first_ = true, falls_ = false;
  double high_ = 0, low_ = 0;
  std::size_t lowest_ = 0;
};

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

/// Minima of guards inside the arc, roots of their rates, which they fall to and rise from by more
/// than what counts as zero, or as nothing beside their value.
void FrictionValidity::WatchDips(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  if (arc.dense.Empty()) return;
  Watched& of = arcs_[k];
  const std::vector<WatchedGuards::Guard>& guards = of.guards->guards();
  Vector x = arc.x_begin;
  const auto at = [&](double t) {
    arc.dense.Evaluate(t, x.data());
    return of.guards->At(x);
  };
  const auto sample = [&](double t) {
    const WatchedGuards::Values values = at(t);
    GuardSample guard{values.value, values.rate, Vector(values.value.size())};
    for (std::size_t g = 0; g < guards.size(); ++g) {
      guard.zero(static_cast<Eigen::Index>(g)) = ZeroOf(guards[g], values, true);
    }
    return guard;
  };
  const std::vector<double> instants = ResolvedInstants(arc, sample);
  std::vector<ValleySearch> valleys(guards.size());
  std::vector<std::pair<double, std::size_t>> dips;
  WatchedGuards::Values before;
  for (std::size_t m = 0; m < instants.size(); ++m) {
    const WatchedGuards::Values now = at(instants[m]);
    for (std::size_t g = 0; g < guards.size(); ++g) {
      const auto row = static_cast<Eigen::Index>(g);
      const double value = now.value(row), rate = now.rate(row);
      const double least = std::max(ZeroOf(guards[g], now, false), kShallow * std::abs(value));
      const auto look = [&](double height, std::size_t piece) {
        if (!valleys[g].Passes(height, piece, least)) return;
        double low = instants[valleys[g].lowest()], high = instants[valleys[g].lowest() + 1];
        for (int i = 0; i < kConeBisections; ++i) {
          const double middle = low + (high - low) / 2;
          (at(middle).rate(row) < 0 ? low : high) = middle;
        }
        dips.emplace_back(high, g);
      };
      if (m > 0 && before.rate(row) * rate < 0) {
        const double length = instants[m] - instants[m - 1];
        look(TurnOfCubic(before.value(row), before.rate(row), value, rate, length), m - 1);
      }
      look(value, m > 0 && rate >= 0 ? m - 1 : m);
    }
    before = now;
  }
  if (dips.empty()) return;
  std::sort(dips.begin(), dips.end());
  PropagatorAlong along(of.dynamics.get(), arc, derivative_.options.tolerance);
  for (const auto& [t, g] : dips) {
    const Matrix& propagator = along.To(t);
    const WatchedGuards::Values least = of.guards->At(along.x());
    const auto row = static_cast<Eigen::Index>(g);
    of.dips.push_back({guards[g].limit, guards[g].constraint, t, least.value(row), 0,
                       least.gradient.row(row) * propagator});
  }
}

}  // namespace contact_flow
