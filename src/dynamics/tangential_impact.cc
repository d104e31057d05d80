// SPDX-License-Identifier: BSD-3-Clause
#include "tangential_impact.h"

#include <cmath>
#include <utility>
#include <vector>

#include "contact_flow/dynamics/guards.h"
#include "contact_flow/model/driven.h"
#include "impact_process.h"

namespace contact_flow {
namespace {

/// What cones may miss, relative; and what impulses and rates are known to.
constexpr double kNearly = 1e-3, kTangentialRounding = 1e-9;

/// Whether what sticks stays within its cone, presses, and what is open does not approach.
bool Holds(const FrictionProblem& problem, const FrictionSolution& word) {
  const double most = word.force.cwiseAbs().maxCoeff();
  const double fastest = problem.b.cwiseAbs().maxCoeff();
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int row = problem.Row(k);
    const FrictionContact& contact = problem.contacts[k];
    if (word.letters[k] == Letter::kOpen) {
      if (word.result(row) < -kTangentialRounding * fastest) return false;
      continue;
    }
    if (word.force(row) < -kTangentialRounding * most) return false;
    if (word.letters[k] != Letter::kStick || !std::isfinite(contact.coefficient)) continue;
    const double held = word.force.segment(row + 1, contact.dimension).norm();
    const double cone = contact.coefficient * word.force(row);
    if (held > (1 + kNearly) * cone + kTangentialRounding * most) return false;
  }
  return most > 0;
}

/// The word that J is with the jammed contact sticking; or another in which that takes an impulse,
/// and may slip in another direction.
std::optional<FrictionSolution> FindImpact(FrictionProblem* problem, std::vector<Letter> letters,
                                           std::size_t jammed) {
  FrictionSolution word;
  word.letters = std::move(letters);
  for (const FrictionContact& contact : problem->contacts) {
    word.directions.push_back(contact.direction);
  }
  if (SolveWord(*problem, &word) && Holds(*problem, word)) return word;
  if (problem->contacts.size() > kMaxCoupledContacts) return std::nullopt;
  for (FrictionContact& contact : problem->contacts) contact.slips = false;
  const double scale = problem->b.cwiseAbs().maxCoeff() / problem->G.diagonal().maxCoeff();
  std::optional<FrictionSolution> best;
  for (FrictionSolution& found : SolveFriction(*problem, kNearly)) {
    const bool takes = found.letters[jammed] != Letter::kOpen && Holds(*problem, found) &&
                       found.force(problem->Row(jammed)) > kTangentialRounding * scale;
    if (takes && (!best || found.margin > best->margin)) best = std::move(found);
  }
  return best;
}

}  // namespace

std::optional<FrictionalImpact> SolveTangentialImpact(const MechanicalSystem& system,
                                                      const VectorRef& q, const VectorRef& v_minus,
                                                      const ContactMode& J, int jammed) {
  if (auto followed = FollowImpact(system, q, v_minus, J, jammed)) return followed;
  const InverseInertia inertia(system, q, v_minus);
  FrictionFrame frame(system, inertia, J);
  FrictionProblem& problem = frame.problem();
  const std::size_t n = problem.contacts.size();
  problem.b = frame.rows() * v_minus;
  std::vector<Letter> letters(n);
  std::size_t place = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const int i = frame.constraints()[k], row = problem.Row(k);
    problem.b(row) = 0;
    FrictionContact& contact = problem.contacts[k];
    letters[k] = i == jammed ? Letter::kStick : J.LetterOf(i);
    if (i == jammed) place = k;
    if (letters[k] == Letter::kStick || contact.dimension == 0) continue;
    if (contact.dimension == 2) {
      contact.direction = problem.b.segment<2>(row + 1).normalized();
    } else {
      contact.direction(0) = SlipSign(J.LetterOf(i));
    }
    contact.slips = true;
  }
  const std::optional<FrictionSolution> word = FindImpact(&problem, std::move(letters), place);
  if (!word) return std::nullopt;
  FrictionalImpact impact;
  for (std::size_t k = 0; k < n; ++k) {
    if (word->letters[k] == Letter::kOpen) continue;
    const bool free = problem.contacts[k].dimension == 0;
    impact.word.Set(frame.constraints()[k], free ? Letter::kSlip : word->letters[k]);
    impact.result.hit.Insert(frame.constraints()[k]);
  }
  impact.result.v_plus = v_minus + frame.reach() * word->force;
  impact.result.impulse = frame.Impulse(inertia, word->force);
  const Vector rates = frame.rows() * (v_minus + impact.result.v_plus);
  impact.energy_change = 0.5 * word->force.dot(rates);
  const double energy = KineticEnergy(inertia.mass(), v_minus) +
                        word->force.cwiseAbs().dot((frame.rows() * v_minus).cwiseAbs());
  if (!impact.result.v_plus.allFinite() || impact.energy_change > kTangentialRounding * energy) {
    return std::nullopt;
  }
  return impact;
}

}  // namespace contact_flow
