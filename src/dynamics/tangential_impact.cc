// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/dynamics/tangential_impact.h"

#include <cmath>

namespace contact_flow {
namespace {

/// What cones may miss, relative; and what impulses and rates are known to.
constexpr double kNearly = 1e-3, kRounding = 1e-9;

}  // namespace

std::optional<FrictionalImpact> SolveTangentialImpact(const MechanicalSystem& system,
                                                      const VectorRef& q, const VectorRef& v_minus,
                                                      ContactMode J, int jammed) {
  const InverseInertia inertia(system, q, v_minus);
  FrictionFrame frame(system, inertia, J);
  FrictionProblem& problem = frame.problem();
  const std::size_t n = problem.contacts.size();
  problem.b = frame.rows() * v_minus;
  FrictionSolution word;
  word.letters.resize(n);
  word.directions.assign(n, Eigen::Vector2d::Zero());
  for (std::size_t k = 0; k < n; ++k) {
    const int i = frame.constraints()[k], row = problem.Row(k);
    problem.b(row) = 0;
    FrictionContact& contact = problem.contacts[k];
    word.letters[k] = i == jammed ? Letter::kStick : J.LetterOf(i);
    if (word.letters[k] == Letter::kStick || contact.dimension == 0) continue;
    const auto slip = problem.b.segment(row + 1, contact.dimension);
    if (contact.dimension == 2) {
      contact.direction = slip.normalized();
    } else {
      contact.direction(0) = J.LetterOf(i) == Letter::kBackward ? -1 : 1;
    }
    contact.slips = true;
    word.directions[k] = contact.direction;
  }
  bool pulls = true;
  while (pulls) {
    if (!SolveWord(problem, &word)) return std::nullopt;
    pulls = false;
    const double size = kRounding * word.force.cwiseAbs().maxCoeff();
    for (std::size_t k = 0; k < n; ++k) {
      if (word.letters[k] == Letter::kOpen || word.force(problem.Row(k)) >= -size) continue;
      if (frame.constraints()[k] == jammed) return std::nullopt;
      word.letters[k] = Letter::kOpen;
      pulls = true;
    }
  }
  const double most = word.force.cwiseAbs().maxCoeff();
  const double fastest = problem.b.cwiseAbs().maxCoeff();
  if (!(most > 0)) return std::nullopt;
  FrictionalImpact impact;
  for (std::size_t k = 0; k < n; ++k) {
    const int i = frame.constraints()[k], row = problem.Row(k);
    if (word.letters[k] == Letter::kOpen) {
      if (word.result(row) < -kRounding * fastest) return std::nullopt;
      continue;
    }
    const FrictionContact& contact = problem.contacts[k];
    const double held = word.force.segment(row + 1, contact.dimension).norm();
    const bool sticks = word.letters[k] == Letter::kStick && std::isfinite(contact.coefficient);
    const double cone = contact.coefficient * word.force(row);
    if (sticks && held > (1 + kNearly) * cone + kRounding * most) return std::nullopt;
    impact.word.Set(i, word.letters[k]);
    impact.result.hit.Insert(i);
  }
  impact.result.v_plus = v_minus + frame.reach() * word.force;
  impact.result.impulse = frame.Spread(word.force);
  impact.result.impulse.segment(system.num_constraints(), system.num_bilateral()) =
      inertia.BilateralForce(Matrix(frame.rows().transpose() * word.force)).col(0);
  const Vector rates = frame.rows() * (v_minus + impact.result.v_plus);
  impact.energy_change = 0.5 * word.force.dot(rates);
  const double energy = 0.5 * v_minus.dot(inertia.mass() * v_minus);
  if (!impact.result.v_plus.allFinite() || impact.energy_change > kRounding * energy) {
    return std::nullopt;
  }
  return impact;
}

}  // namespace contact_flow
