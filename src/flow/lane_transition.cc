// SPDX-License-Identifier: BSD-3-Clause
#include "lane_transition.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "contact_flow/dynamics/complementarity.h"
#include "contact_flow/dynamics/impact.h"
#include "resolution.h"

namespace contact_flow {
namespace {

/// What could be decided otherwise is left to ResolveTransition, with room for rounding: guards
/// that vanish together with the trigger's are below 5 reaches, forces near zero below 1e-4 of the
/// largest (SelectMode).
constexpr double kReaches = 6, kNearZero = 2e-4;

}  // namespace

PlasticTouchdown::PlasticTouchdown(const MechanicalSystem& system)
    : system_(system),
      inertia_(system, system.nominal().x.head(system.num_positions()),
               system.nominal().x.tail(system.dof())) {}

const PlasticTouchdown::Contacts& PlasticTouchdown::Of(ConstraintSet set) {
  for (const Contacts& contacts : known_) {
    if (contacts.set == set) return contacts;
  }
  Contacts contacts;
  contacts.set = set;
  contacts.rows = inertia_.Rows(set);
  contacts.delassus = contacts.rows * (inertia_ * contacts.rows.transpose());
  known_.push_back(std::move(contacts));
  return known_.back();
}

double PlasticTouchdown::Rounding(int i, const VectorRef& v) const {
  return kRounding * terms_.jacobian.row(i).cwiseAbs().dot(v.cwiseAbs());
}

/// Whether the trigger closes at speed, and no other guard vanishes with it; terms_ and rate_ are
/// those at x.
bool PlasticTouchdown::IsAlone(ContactDynamics* dynamics, const Vector& x, ContactMode mode,
                               int trigger, const TransitionRules& rules) {
  const int d = system_.dof();
  const auto v = x.tail(d);
  const double slow = std::max(rules.speed_tolerance, Rounding(trigger, v));
  if (!(rate_(trigger) < -slow)) return false;
  const double far = x.head(d).cwiseAbs().maxCoeff();
  const double floor = std::max(rules.gap_tolerance, kRounding * far);
  const double reach = rules.relative_tolerance * far + rules.absolute_tolerance;
  for (int i = 0; i < system_.num_constraints(); ++i) {
    if (i == trigger || mode.Contains(i)) continue;
    const double size = terms_.jacobian.row(i).cwiseAbs().sum();
    const double near = kReaches * kAccumulated * size * reach;
    if (!(terms_.gap(i) > std::max(near, floor * std::max(1.0, size)))) return false;
  }
  if (mode.Empty()) return true;
  Vector reaches(2 * d);
  reaches << Vector::Constant(d, rules.relative_tolerance * far),
      rules.relative_tolerance * v.cwiseAbs();
  reaches.array() += rules.absolute_tolerance;
  dynamics->Differentiate(x, mode);
  for (int i : mode) {
    const double near = kReaches * kAccumulated *
                        dynamics->force_jacobian().row(i).head(2 * d).cwiseAbs().dot(reaches);
    if (!(dynamics->force()(i) > near)) return false;
  }
  return true;
}

/// Whether all contacts clearly press at x, which is after the impact.
bool PlasticTouchdown::Press(const Contacts& contacts, const Vector& u, const Vector& x) {
  const int d = system_.dof();
  system_.Dynamics(x.head(d), x.tail(d), u, ContactMode(), nullptr, &applied_);
  const Vector free = inertia_ * applied_;
  const Matrix &A = contacts.rows, &G = contacts.delassus;
  const Vector b = A * free;
  const std::optional<ComplementaritySolution> solution = SolveComplementarity(G, b);
  if (!solution || solution->support.Size() != A.rows()) return false;
  const Vector gain = G.diagonal(), w = G * solution->z + b;
  const Vector force = solution->z - w.cwiseQuotient(gain);
  const double applied = applied_.cwiseAbs().maxCoeff();
  const Vector size = A.cwiseAbs() * free.cwiseAbs() + G.cwiseAbs() * solution->z;
  double largest = force.cwiseAbs().maxCoeff();
  for (Eigen::Index row = 0; row < A.rows(); ++row) {
    const double balance = applied / A.row(row).cwiseAbs().maxCoeff();
    largest = std::max(largest, size(row) / gain(row) + balance);
  }
  return force.minCoeff() > kNearZero * (1 + largest);
}

std::optional<ResolvedTransition> PlasticTouchdown::Resolve(ContactDynamics* dynamics, double t,
                                                            const Vector& x, ContactMode mode,
                                                            int trigger,
                                                            const TransitionRules& rules) {
  const int d = system_.dof();
  const bool usual = rules.simultaneity_tolerance == 0 && rules.implied.Empty() &&
                     rules.impact_law == ImpactLaw::kComplementarity && !mode.Contains(trigger);
  if (!usual || inertia_.mass_factor().sparse()) return std::nullopt;
  const ConstraintSet touching = mode.Members().With(trigger);
  for (int i : touching) {
    if (system_.restitution()(i) != 0) return std::nullopt;
  }
  const Vector v_minus = x.tail(d);
  system_.Constraints(x.head(d), v_minus, &terms_);
  rate_ = terms_.jacobian * v_minus;
  if (!IsAlone(dynamics, x, mode, trigger, rules)) return std::nullopt;
  ImpactResult impact;
  try {
    impact = SolveImpact(system_, inertia_, v_minus, touching, rules.impact_law);
  } catch (const std::domain_error&) {
    return std::nullopt;
  }
  const Vector rate = terms_.jacobian * impact.v_plus;
  double residual = 0, size = 0;
  for (int i : touching) {
    residual = std::max(residual, std::abs(rate(i)));
    size = std::max(size, Rounding(i, v_minus));
    const double rounding = std::max(Rounding(i, v_minus), Rounding(i, impact.v_plus));
    if (!(std::abs(rate(i)) <= rounding)) return std::nullopt;
  }
  x_plus_ = x;
  x_plus_.tail(d) = impact.v_plus;
  if (residual > size || !Press(Of(touching), dynamics->u(), x_plus_)) return std::nullopt;
  ResolvedTransition result;
  result.approach_speed = -rate_(trigger);
  result.release_rate = std::numeric_limits<double>::infinity();
  Transition& transition = result.transition;
  transition.t = t;
  transition.x_minus = x;
  transition.x_plus = x_plus_;
  transition.mode_before = mode;
  transition.mode_after = mode.With(trigger);
  transition.activated = ConstraintSet({trigger});
  transition.impulse = std::move(impact.impulse);
  return result;
}

}  // namespace contact_flow
