// SPDX-License-Identifier: BSD-3-Clause
#include "friction_validity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/dynamics/word_selection.h"
#include "row_accelerations.h"
#include "validity_margins.h"

namespace contact_flow {
namespace {

/// Step of difference quotients along a tangent of unit length.
constexpr double kConeStep = 1e-6;

void ConsiderGuard(double value, const Eigen::RowVectorXd& gradient, double rate, const Vector& w,
                   double shift, ValidityRadius::Limit limit, int constraint, double t,
                   ValidityRadius* smallest) {
  const double change = gradient.dot(w) + rate * shift;
  const double terms = gradient.cwiseAbs().dot(w.cwiseAbs()) + std::abs(rate * shift);
  if (!(change < -kMarginNoise * terms)) return;
  Consider(value, change, limit, constraint, t, smallest);
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
    of.mode = arc.mode;
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

/// d(dh/dt) along a tangent: of a slip in the plane, d/dt T v, also by (δu, δp).
double FrictionValidity::RateChange(const Watched& of, Eigen::Index guard, const Vector& x,
                                    double rate, const Vector& along) const {
  const WatchedGuards::Guard& at = of.guards->guards()[static_cast<std::size_t>(guard)];
  const Friction& friction = system_.friction()[static_cast<std::size_t>(at.constraint)];
  if (at.limit == Limit::kSlip && friction.dimension == 1) {
    const double sign = SlipSign(of.mode.LetterOf(at.constraint));
    return sign * RowAccelerations(of.dynamics.get(), x, of.mode).Gradient(friction.row).dot(along);
  }
  const Vector tangent = along.head(2 * system_.dof());
  const double length = tangent.norm();
  if (!(length > 0)) return 0;
  const Vector aside = system_.Perturb(x, kConeStep / length * tangent);
  return (of.guards->At(aside).rate(guard) - rate) * length / kConeStep;
}

/// ∂(Da_i v)/∂p δp, the change of a normal speed by the parameters of w.
double FrictionValidity::SpeedChange(const ContactDynamics& dynamics, int constraint,
                                     const Vector& x, const Vector& w) const {
  const std::vector<int>& parameters = dynamics.variables().parameters;
  if (parameters.empty()) return 0;
  const int d = system_.dof(), nq = system_.num_positions();
  ParameterJacobian by_parameter;
  system_.DifferentiateImpactByParameters(x.head(nq), Vector::Zero(d),
                                          Vector::Zero(system_.num_rows()), x.tail(d), parameters,
                                          &by_parameter);
  const Vector by = w.tail(static_cast<Eigen::Index>(parameters.size()));
  return by_parameter.constraint.row(constraint).dot(by);
}

/// Guards that vanish at transition k, for the tangent w before it, have to cross zero.
void FrictionValidity::CheckCrossings(std::size_t k, const Vector& w,
                                      ValidityRadius* smallest) const {
  const Watched& of = arcs_[k];
  for (Eigen::Index row : of.vanishing) {
    const WatchedGuards::Guard& guard = of.guards->guards()[static_cast<std::size_t>(row)];
    // |T v| in space: at its end the rate has no derivative.
    const auto contact = static_cast<std::size_t>(guard.constraint);
    if (guard.limit == Limit::kSlip && system_.friction()[contact].dimension == 2) continue;
    const double rate = of.end.rate(row);
    const double time = -of.end.gradient.row(row).dot(w) / rate;
    const Vector& x = trajectory_.arcs[k].x_end;
    double change = RateChange(of, row, x, rate, w + time * of.end.field);
    if (guard.limit == Limit::kGap) {
      change += SpeedChange(*of.dynamics, guard.constraint, x, w);
    }
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
    double change = RateChange(of, row, arc.x_begin, rate, w + shift * of.begin.field);
    if (guard.limit == Limit::kGap) {
      change += SpeedChange(*of.dynamics, guard.constraint, arc.x_begin, w);
    }
    const Limit limit = guard.limit == Limit::kGap ? Limit::kImpulse : Limit::kSlipRate;
    Consider(rate, change, limit, guard.constraint, arc.t_begin, smallest);
  }
}

/// Whether the impulses of transition k are shared by contacts whose rows depend on each other: one
/// share of them tells nothing.
bool FrictionValidity::SharesImpulses(const Transition& transition) const {
  const Vector q = transition.x_minus.head(system_.num_positions());
  const InverseInertia inertia(system_, q, transition.x_minus.tail(system_.dof()));
  const FrictionFrame frame(system_, inertia, transition.impulse_word);
  const FrictionProblem& problem = frame.problem();
  std::vector<int> basis;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int row = problem.Row(k);
    const Letter letter = transition.impulse_word.LetterOf(frame.constraints()[k]);
    const int rows = letter == Letter::kStick ? 1 + problem.contacts[k].dimension : 1;
    for (int r = row; r < row + rows; ++r) {
      if (Independence(problem.G, basis, r) <= kDependentRow) return true;
      basis.push_back(r);
    }
  }
  return false;
}

/// The impulses of transition k, a single touchdown that comes later by `time`, for the tangent w
/// before it: those of contacts that stick stay in their cones, those of others that rest push,
/// and what slips slips on.
void FrictionValidity::CheckImpulses(std::size_t k, const Vector& w, double time,
                                     ValidityRadius* smallest) const {
  const Transition& transition = trajectory_.transitions[k];
  const int d = system_.dof(), nq = system_.num_positions();
  const Vector along = (w + time * arcs_[k].end.field).head(2 * d);
  const double length = along.norm();
  if (!(length > 0) || SharesImpulses(transition)) return;
  const Vector aside = system_.Perturb(transition.x_minus, kConeStep / length * along);
  const ContactMode held = transition.mode_before.Without(system_.compliant());
  ImpactResult result;
  try {
    result = SolveFrictionalImpact(system_, aside.head(nq), aside.tail(d),
                                   held | transition.activated, held)
                 .result;
  } catch (const FrictionRefusal&) {
    return;
  }
  const Vector& moved = result.impulse;
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
  const auto slip = [&](const Vector& x, const Vector& v_plus, const Friction& friction) {
    ConstraintTerms terms;
    system_.Constraints(x.head(nq), v_plus, &terms);
    return (terms.jacobian.middleRows(friction.row, friction.dimension) * v_plus).norm();
  };
  for (int i : transition.impulse_word) {
    if (!transition.activated.Contains(i)) consider(i, false, Limit::kImpulse);
    const Friction& friction = system_.friction()[i];
    if (friction.dimension == 0 || std::isinf(friction.coefficient)) continue;
    if (transition.impulse_word.LetterOf(i) == Letter::kStick) {
      consider(i, true, Limit::kImpulseCone);
      continue;
    }
    const double now = slip(transition.x_minus, transition.x_plus.tail(d), friction);
    const double change = (slip(aside, result.v_plus, friction) - now) * length / kConeStep;
    Consider(now, change, Limit::kImpulseCone, i, transition.t, smallest);
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
