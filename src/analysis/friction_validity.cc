// SPDX-License-Identifier: BSD-3-Clause
#include "friction_validity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/derivative/variation.h"
#include "contact_flow/dynamics/word_selection.h"
#include "validity_margins.h"

namespace contact_flow {
namespace {

/// Step of difference quotients along a tangent of unit length.
constexpr double kConeStep = 1e-6;
/// Forces below this part of the largest are zero, and rates below it of their terms.
constexpr double kZero = 1e-7;
/// Of one step, each with at most one turn of a guard.
constexpr int kConePieces = 8;
/// Of a piece, down to rounding.
constexpr int kConeBisections = 45;

void ConsiderGuard(double value, const Eigen::RowVectorXd& gradient, double rate, const Vector& w,
                   double shift, ValidityRadius::Limit limit, int constraint, double t,
                   ValidityRadius* smallest) {
  const double change = gradient.dot(w) + rate * shift;
  const double terms = gradient.cwiseAbs().dot(w.cwiseAbs()) + std::abs(rate * shift);
  if (!(change < -kMarginNoise * terms)) return;
  Consider(value, change, limit, constraint, t, smallest);
}

/// The part of Dh F that the sum of its terms leaves.
bool Moves(const WatchedGuards::Values& at, Eigen::Index guard) {
  const double terms = at.gradient.row(guard).cwiseAbs().dot(at.field.cwiseAbs());
  return std::abs(at.rate(guard)) > kZero * terms;
}

}  // namespace

FrictionValidity::FrictionValidity(const MechanicalSystem& system, const Trajectory& trajectory,
                                   const BDerivative& derivative)
    : system_(system),
      trajectory_(trajectory),
      derivative_(derivative),
      efforts_(system, trajectory, derivative) {
  arcs_.resize(trajectory.arcs.size());
  for (std::size_t k = 0; k < arcs_.size(); ++k) {
    AskBudget();
    const Arc& arc = trajectory.arcs[k];
    Watched& of = arcs_[k];
    of.dynamics = std::make_unique<ContactDynamics>(system, arc.u, derivative.options.variables);
    of.guards = std::make_unique<WatchedGuards>(of.dynamics.get(), arc.x_begin, arc.mode);
    // An arc inside a cluster has no length.
    of.absorbed = k < derivative.events.size() && derivative.events[k].absorbed();
    of.begin = of.guards->At(arc.x_begin);
    of.end = of.guards->At(arc.x_end);
    if (of.absorbed) continue;
    WatchEnds(k);
    WatchDips(k);
  }
}

bool FrictionValidity::IsZero(const WatchedGuards::Guard& guard, const WatchedGuards::Values& at,
                              Eigen::Index k) const {
  const bool is_gap = guard.limit == Limit::kGap, is_slip = guard.limit == Limit::kSlip;
  const double zero = is_gap    ? trajectory_.gap_tolerance
                      : is_slip ? trajectory_.speed_tolerance
                                : kZero * at.force;
  return at.value(k) <= zero;
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
/// others turn, jump, or the run ends.
void FrictionValidity::WatchEnds(std::size_t k) {
  const Arc& arc = trajectory_.arcs[k];
  Watched& of = arcs_[k];
  const bool last = k + 1 == arcs_.size();
  const ConstraintSet bounced =
      k == 0 ? ConstraintSet::All(system_.num_constraints())
             : trajectory_.transitions[k - 1].activated | trajectory_.transitions[k - 1].switched;
  const std::vector<WatchedGuards::Guard>& guards = of.guards->guards();
  for (std::size_t g = 0; g < guards.size(); ++g) {
    const auto row = static_cast<Eigen::Index>(g);
    const auto& [number, constraint, limit] = guards[g];
    const bool is_gap = limit == Limit::kGap;
    if (!IsZero(guards[g], of.begin, row)) {
      of.begins.push_back({limit, constraint, arc.t_begin, of.begin.value(row), of.begin.rate(row),
                           of.begin.gradient.row(row)});
    } else if (of.begin.rate(row) > 0 && Moves(of.begin, row) &&
               !(is_gap && bounced.Contains(constraint)) &&
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
    if (IsZero(guards[g], of.end, row) && !crosses) continue;
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
    risen[g] = !IsZero(guards[g], of.begin, static_cast<Eigen::Index>(g));
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
  for (std::size_t step = 0; step < arc.dense.NumSteps(); ++step) {
    AskBudget();
    const double begin = arc.dense.StepBegin(step);
    const double end = std::min(begin + arc.dense.StepLength(step), arc.t_end);
    for (int piece = 1; piece <= kConePieces; ++piece) {
      look(begin + (end - begin) * piece / kConePieces);
    }
  }
}

/// Of transition k, for the tangent w before it: the events that change something to first order,
/// and the guards that vanish before it.
FrictionValidity::Instants FrictionValidity::InstantsOf(std::size_t k, const Vector& w) const {
  const Watched& of = arcs_[k];
  Instants instants{std::numeric_limits<double>::infinity(), 0};
  instants.last = -instants.first;
  const auto add = [&](double time) {
    instants.first = std::min(instants.first, time);
    instants.last = std::max(instants.last, time);
  };
  if (trajectory_.transitions[k].changes_input) add(0);
  for (Eigen::Index row : of.vanishing) add(-of.end.gradient.row(row).dot(w) / of.end.rate(row));
  if (!trajectory_.transitions[k].activated.Empty()) {
    for (const PerturbedEvent& event : derivative_.events[k].PerturbedEvents(w)) add(event.time);
  }
  if (!(instants.first <= instants.last)) add(0);
  return instants;
}

/// d(dh/dt) along a tangent.
double FrictionValidity::RateChange(const Watched& of, Eigen::Index guard, const Vector& x,
                                    double rate, const Vector& along) const {
  const Vector tangent = along.head(2 * system_.dof());
  const double length = tangent.norm();
  if (!(length > 0)) return 0;
  const Vector aside = system_.Perturb(x, kConeStep / length * tangent);
  return (of.guards->At(aside).rate(guard) - rate) * length / kConeStep;
}

/// Guards that vanish at transition k, for the tangent w before it, have to cross zero.
void FrictionValidity::CheckCrossings(std::size_t k, const Vector& w,
                                      ValidityRadius* smallest) const {
  const Watched& of = arcs_[k];
  for (Eigen::Index row : of.vanishing) {
    const WatchedGuards::Guard& guard = of.guards->guards()[static_cast<std::size_t>(row)];
    const double rate = of.end.rate(row);
    const double time = -of.end.gradient.row(row).dot(w) / rate;
    const double change =
        RateChange(of, row, trajectory_.arcs[k].x_end, rate, w + time * of.end.field);
    const Limit limit = guard.limit == Limit::kGap     ? Limit::kApproachSpeed
                        : guard.limit == Limit::kForce ? Limit::kReleaseRate
                                                       : Limit::kSlipRate;
    ConsiderFold(rate, change, limit, guard.constraint, trajectory_.transitions[k].t, smallest);
  }
}

/// Guards that grow from zero at the begin of arc k, which comes later by `shift`, for the tangent
/// w there.
void FrictionValidity::CheckGrowing(std::size_t k, const Vector& w, double shift,
                                    ValidityRadius* smallest) const {
  const Watched& of = arcs_[k];
  const Arc& arc = trajectory_.arcs[k];
  for (Eigen::Index row : of.growing) {
    const WatchedGuards::Guard& guard = of.guards->guards()[static_cast<std::size_t>(row)];
    const double rate = of.begin.rate(row);
    const double change = RateChange(of, row, arc.x_begin, rate, w + shift * of.begin.field);
    const Limit limit = guard.limit == Limit::kGap ? Limit::kImpulse : Limit::kSlipRate;
    Consider(rate, change, limit, guard.constraint, arc.t_begin, smallest);
  }
}

/// The impulses of transition k, a single touchdown that comes later by `time`, for the tangent w
/// before it: those of contacts that stick stay in their cones, those of others that rest push.
void FrictionValidity::CheckImpulses(std::size_t k, const Vector& w, double time,
                                     ValidityRadius* smallest) const {
  const Transition& transition = trajectory_.transitions[k];
  const int d = system_.dof(), nq = system_.num_positions();
  const Vector along = (w + time * arcs_[k].end.field).head(2 * d);
  const double length = along.norm();
  if (!(length > 0)) return;
  const Vector aside = system_.Perturb(transition.x_minus, kConeStep / length * along);
  const ContactMode held = transition.mode_before.Without(system_.compliant());
  Vector moved;
  try {
    moved = SolveFrictionalImpact(system_, aside.head(nq), aside.tail(d),
                                  held | transition.activated, held)
                .result.impulse;
  } catch (const FrictionRefusal&) {
    return;
  }
  const Vector& p = transition.impulse;
  const auto margin = [&](const Vector& impulse, int i, bool cone) {
    const Friction& friction = system_.friction()[i];
    if (!cone) return impulse(i);
    return friction.coefficient * impulse(i) -
           impulse.segment(friction.row, friction.dimension).norm();
  };
  const auto consider = [&](int i, bool cone, Limit limit) {
    const double now = margin(p, i, cone);
    const double change = (margin(moved, i, cone) - now) * length / kConeStep;
    Consider(now, change, limit, i, transition.t, smallest);
  };
  for (int i : transition.impulse_word) {
    if (!transition.activated.Contains(i)) consider(i, false, Limit::kImpulse);
    const Friction& friction = system_.friction()[i];
    const bool sticks = transition.impulse_word.LetterOf(i) == Letter::kStick;
    if (!sticks || friction.dimension == 0 || std::isinf(friction.coefficient)) continue;
    consider(i, true, Limit::kImpulseCone);
  }
}

ValidityRadius FrictionValidity::operator()(const VectorRef& direction) const {
  ValidityRadius smallest;
  Vector w = Vector::Zero(derivative_.arcs.front().cols());
  w.head(direction.size()) = direction;
  const StartCone::Bound bound = derivative_.start.Limit(w);
  if (bound.constraint >= 0) {
    smallest = {bound.alpha, Limit::kGap, bound.constraint, trajectory_.t_begin()};
    if (bound.alpha == 0) return smallest;
  }
  w = derivative_.Begin(w);
  // The last event so far: its time, and how that moves.
  double t = trajectory_.t_begin(), latest = 0;
  Limit order = Limit::kStart;
  const auto consider = [&](const std::vector<Watch>& watches, double shift) {
    for (const Watch& of : watches) {
      ConsiderGuard(of.value, of.gradient, of.rate, w, shift, of.limit, of.constraint, of.t,
                    &smallest);
    }
  };
  for (std::size_t k = 0; k < arcs_.size(); ++k) {
    AskBudget();
    const Watched& of = arcs_[k];
    if (!of.begin.rate.allFinite() || !of.end.rate.allFinite()) {
      smallest.radius = std::numeric_limits<double>::quiet_NaN();
      return smallest;
    }
    consider(of.begins, latest);
    CheckGrowing(k, w, latest, &smallest);
    consider(of.dips, 0);
    efforts_.ConsiderArc(k, w, latest, &smallest);
    w = derivative_.arcs[k] * w;
    const bool last = k + 1 == arcs_.size();
    if (!last && of.absorbed) continue;  // with that before
    const Instants instants = last ? Instants{} : InstantsOf(k, w);
    consider(of.ends, instants.first);
    efforts_.ConsiderEnd(k, w, instants.first, &smallest);
    if (last) break;
    CheckCrossings(k, w, &smallest);
    const Transition& transition = trajectory_.transitions[k];
    Consider(transition.t - t, instants.first - latest, order, -1, transition.t, &smallest);
    t = transition.t;
    latest = instants.last;
    order = Limit::kEventOrder;
    if (transition.activated.Size() == 1) CheckImpulses(k, w, instants.first, &smallest);
    w = derivative_.events[k](w);
  }
  if (order == Limit::kEventOrder) {
    Consider(trajectory_.t_end() - t, -latest, Limit::kHorizon, -1, t, &smallest);
  }
  return smallest;
}

}  // namespace contact_flow
