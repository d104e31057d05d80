// SPDX-License-Identifier: BSD-3-Clause
#include "event_laws.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/inverse_inertia.h"
#include "contact_flow/model/driven.h"

namespace contact_flow {
namespace {

/// Faces are compared for at most this many simultaneous activations.
constexpr int kMaxComparedActivations = 5;
/// Of velocities that sums of several terms have made, relative.
constexpr double kLawRounding = 1e-15;

/// Largest |difference_i| over the size of the terms that it is made of.
double RelativeResidual(const Vector& difference, double size) {
  double largest = 0;
  for (Eigen::Index i = 0; i < difference.size(); ++i) {
    if (difference(i) != 0) largest = std::max(largest, std::abs(difference(i)) / size);
  }
  return largest;
}

/// A lower estimate of the condition of a symmetric matrix S scaled to a unit diagonal: by the
/// pivots of its Cholesky factor, which are L_ii / √S_ii where S = L Lᵀ.
double ScaledCondition(const Matrix& symmetric, bool regular,
                       const Eigen::Ref<const Vector, 0, Eigen::InnerStride<>>& diagonal) {
  if (symmetric.size() == 0) return 1;
  if (!regular) return std::numeric_limits<double>::infinity();
  const auto pivots = diagonal.array() / symmetric.diagonal().array().sqrt();
  const double ratio = pivots.maxCoeff() / pivots.minCoeff();
  return ratio * ratio;
}

/// What rounding leaves of the directions of slips in space: one that begins is hardly faster.
double DirectionNoise(const MechanicalSystem& system, const Transition& transition) {
  double noise = 0;
  const Vector v = transition.x_plus.tail(system.dof());
  ConstraintTerms terms;
  for (int i : transition.mode_after - system.compliant()) {
    if (transition.mode_after.LetterOf(i) != Letter::kSlip || !system.HasFriction()) continue;
    const Friction& friction = system.friction()[i];
    if (friction.dimension < 2 || !(friction.coefficient > 0)) continue;
    system.Constraints(transition.x_plus.head(system.num_positions()), v, &terms);
    const auto T = terms.jacobian.middleRows<2>(friction.row);
    const double rounding = kLawRounding * (T.cwiseAbs() * v.cwiseAbs()).norm();
    noise = std::max(noise, rounding / (T * v).norm());
  }
  return noise;
}

/// What the one change of the state without impact does to the field, by the speed that a slip in
/// space is given to begin with, or what is left of one that ends: as much as that again.
double JumpNoise(ContactDynamics* after, const Transition& transition, const Vector& field) {
  if (!transition.activated.Empty()) return 0;
  Vector x = transition.x_plus;
  auto v = x.tail(after->system().dof());
  v += v - transition.x_minus.tail(v.size());
  const double noise = (after->Field(x, transition.mode_after) - field).lpNorm<Eigen::Infinity>();
  return std::isfinite(noise) ? noise : 0;
}

/// B(F⁻) = F⁺: a run that is late by δt meets the transition late by δt, and is late after it.
double EventLaw(ContactDynamics* before, ContactDynamics* after, const Transition& transition,
                const EventMap& map, EventResidual* residual) {
  const Vector field = before->Field(transition.x_minus, transition.mode_before);
  const Vector field_after = after->Field(transition.x_plus, transition.mode_after);
  // Its changes of the input are early as well.
  residual->value = map(field, -Vector::Ones(map.num_input_changes())) - field_after;
  residual->size = std::max(field.cwiseAbs().maxCoeff(), field_after.cwiseAbs().maxCoeff());
  const double left = RelativeResidual(residual->value, residual->size);
  double noise = DirectionNoise(before->system(), transition);
  if (left > kLawLimit) noise += JumpNoise(after, transition, field_after) / residual->size;
  return std::max(0.0, left - noise);
}

/// Selections of orders that differ by one exchange agree where the two events come at once.
double FaceLaw(const MechanicalSystem& system, const Variables& variables, const EventMap& map) {
  const int m = map.num_activations();
  const std::vector<int> order = map.activated();
  if (m < 2 || m > kMaxComparedActivations || !map.PiecewiseLinear(order).ok()) return 0;
  Matrix times = map.Times(order);
  const Matrix selection = map.Selection(order);
  // Which contacts an impact lifts beside another, or a change of the input before it, is so for
  // tangents that keep closed what is held.
  Matrix admitted;
  const Transition& cluster = map.transition();
  if (!cluster.mode_before.Empty()) {
    admitted = Matrix::Identity(selection.cols(), selection.cols());
    for (Eigen::Index j = 0; j < admitted.cols(); ++j) {
      admitted.col(j) = ProjectAdmissible(system, cluster.x_minus, cluster.mode_before,
                                          Vector(admitted.col(j)), variables);
    }
    times = (times * admitted).eval();
  }
  double largest = 0;
  for (int k = 0; k + 1 < m; ++k) {
    std::vector<int> exchanged = order;
    std::swap(exchanged[k], exchanged[k + 1]);
    if (map.IsInputChange(order[k]) && map.IsInputChange(order[k + 1])) continue;
    if (!map.PiecewiseLinear(exchanged).ok()) continue;
    // The difference has rank one, along the normal of {τ_k = τ_{k+1}}: nothing is left beside it.
    const Eigen::RowVectorXd normal = times.row(k + 1) - times.row(k);
    Matrix difference = map.Selection(exchanged) - selection;
    if (admitted.size() > 0) difference = (difference * admitted).eval();
    if (normal.squaredNorm() > 0) {
      difference -= difference * normal.transpose() * normal / normal.squaredNorm();
    }
    const double size = std::max(1.0, selection.cwiseAbs().maxCoeff());
    largest = std::max(largest, difference.cwiseAbs().maxCoeff() / size);
  }
  return largest;
}

/// Momentum, energy and conditions at the transition.
void AssessImpact(const MechanicalSystem& system, const Transition& transition, Trust* trust) {
  const int d = system.dof(), nq = system.num_positions();
  const Vector q = transition.x_minus.head(nq), v = transition.x_minus.tail(d);
  const InverseInertia inertia(system, q, v);
  const ConstraintSet touching =
      (transition.mode_before | transition.activated | transition.touching) - system.compliant();
  const Matrix rows = inertia.Rows(touching);
  const Matrix delassus = rows * (inertia * rows.transpose());
  const MassFactor& mass = inertia.mass_factor();
  const Eigen::LLT<Matrix> factor(delassus);
  trust->condition = std::max(
      ScaledCondition(inertia.mass(), mass.regular(), mass.Pivots()),
      ScaledCondition(delassus, factor.info() == Eigen::Success, factor.matrixLLT().diagonal()));
  if (transition.activated.Empty()) return;
  const Matrix& A = inertia.terms().jacobian;
  Vector v_plus = transition.x_plus.tail(d);
  if (transition.begun.size() > 0) v_plus -= transition.begun;
  // In the kinetic metric, where momenta of all units compare: |M Δv − Aᵀp| beside |M v|.
  const Vector momentum = inertia.mass() * Moved(inertia.mass(), v),
               later_momentum = inertia.mass() * Moved(inertia.mass(), v_plus);
  const auto size = [&](Vector momentum) {
    mass.SolveL(momentum);
    return momentum.norm();
  };
  const double speed = size(momentum) + size(later_momentum);
  const bool rests = transition.rest_impulse.size() > 0;
  if (speed > 0) {
    Vector impulse = transition.impulse;
    if (rests) impulse += transition.rest_impulse;
    const Vector given = inertia.mass() * (v_plus - v) - A.transpose() * impulse;
    trust->momentum = size(Moved(inertia.mass(), given)) / speed;
  }
  const Vector& restitution = system.restitution();
  for (int i : touching) {
    if (restitution(i) != restitution(*touching.begin()) || restitution(i) > 1) return;
  }
  // Of the impact alone: bounces that are made to rest may win the work of forces between them.
  Vector struck = v_plus;
  if (rests) struck -= mass.Solved(A.transpose() * transition.rest_impulse);
  const Vector struck_momentum = inertia.mass() * Moved(inertia.mass(), struck);
  // What is driven is pushed, too, and gives or takes the work of that.
  const Vector push = A.transpose() * transition.impulse;
  const double given = push.dot(v - Moved(inertia.mass(), v));
  const double energy = v.dot(momentum), later = struck.dot(struck_momentum) + 2 * given;
  const double size_of_both = energy + 2 * std::abs(given);
  if (size_of_both > 0) trust->energy = std::max(0.0, (later - energy) / size_of_both);
}

}  // namespace

Status CheckEventLaws(ContactDynamics* before, ContactDynamics* after, const Transition& transition,
                      const EventMap& map, Trust* trust, EventResidual* residual) {
  Trust own;
  residual->value = Vector::Zero(2 * before->system().dof() + before->num_variables());
  if (!transition.changes_input || map.num_input_changes() > 0) {
    own.event_law = EventLaw(before, after, transition, map, residual);
  }
  own.face_law = FaceLaw(before->system(), before->variables(), map);
  AssessImpact(before->system(), transition, &own);
  trust->event_law = std::max(trust->event_law, own.event_law);
  trust->face_law = std::max(trust->face_law, own.face_law);
  trust->momentum = std::max(trust->momentum, own.momentum);
  trust->energy = std::max(trust->energy, own.energy);
  trust->condition = std::max(trust->condition, own.condition);
  const std::pair<const char*, double> laws[] = {
      {"B(F⁻) = F⁺", own.event_law},
      {"that selections agree on their common face", own.face_law},
      {"M (v⁺ − v⁻) = Daᵀ p", own.momentum},
      {"that an impact wins no energy", own.energy}};
  for (const auto& [law, residual] : laws) {
    if (residual <= kLawLimit) continue;
    std::ostringstream message;
    message << "at t = " << transition.t << " s the self-check " << law << " fails by " << residual
            << " (limit " << kLawLimit << "): the derivative is withheld";
    // What was made to rest there had a momentum that no impulse took.
    if (residual == own.momentum && transition.energy_lost > 0) {
      message << "; bounces too low to be resolved were made to rest there, and lost "
              << transition.energy_lost << " J";
    }
    return {Outcome::kNotDifferentiable, message.str()};
  }
  return {};
}

}  // namespace contact_flow
