// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>

#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/model/driven.h"
#include "row_units.h"

namespace contact_flow {
namespace {

/// Motions that differ by less than this, relative, are one.
constexpr double kSameImpact = 1e-8;
/// Energy that an impact may gain by rounding, relative.
constexpr double kEnergyRounding = 1e-10;

/// The contacts that an impact is shared among: not those that do not approach and whose normal
/// rows no other row feels, like the pads of joints with friction. These get no impulse.
ConstraintSet Bearing(const MechanicalSystem& system, const InverseInertia& inertia,
                      const VectorRef& v, const ConstraintSet& touching) {
  const FrictionFrame frame(system, inertia, touching);
  const FrictionProblem& problem = frame.problem();
  const Vector rate = frame.rows() * v;
  const Vector rounding = frame.RateRounding(inertia, v, ContactMode());
  ConstraintSet bearing = touching;
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    const int row = problem.Row(k);
    if (rate(row) >= -rounding(row) && StandsAlone(problem, k)) {
      bearing.Erase(frame.constraints()[k]);
    }
  }
  return bearing.Empty() ? touching : bearing;
}

}  // namespace

FrictionalImpact SolveFrictionalImpact(const MechanicalSystem& system, const VectorRef& q,
                                       const VectorRef& v_minus, const ConstraintSet& touching,
                                       const ContactMode& before_impact, WordConventions* by) {
  const InverseInertia inertia(system, q, v_minus);
  FrictionFrame frame(system, inertia, Bearing(system, inertia, v_minus, touching));
  FrictionProblem& problem = frame.problem();
  const Vector before = frame.rows() * v_minus;
  problem.b = before;
  problem.rounding = frame.RateRounding(inertia, v_minus, before_impact);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    problem.b(problem.Row(k)) *= 1 + system.restitution()(frame.constraints()[k]);
  }
  const std::string names = touching.ToString(system.description().constraints);
  std::vector<FrictionSolution> all = SolveFriction(problem);
  if (all.empty()) {
    throw FrictionRefusal(FrictionRefusal::Kind::kNoImpact,
                          "no impulses of the contacts " + names + " end the impact: they jam");
  }
  const auto several = [&](const FrictionSolution& other) {
    const double apart = (other.result - all.front().result).cwiseAbs().maxCoeff();
    return other.many || !(apart <= kSameImpact * problem.b.cwiseAbs().maxCoeff());
  };
  if (std::any_of(all.begin(), all.end(), several)) {
    const bool many = std::any_of(all.begin(), all.end(), [](const auto& s) { return s.many; });
    if (by == nullptr || many) {
      throw FrictionRefusal(FrictionRefusal::Kind::kAmbiguousImpact,
                            "several impulses of the contacts " + names + " end the impact");
    }
    by->smallest = true;
    const auto size = [&](const FrictionSolution& s) { return s.force.dot(problem.G * s.force); };
    std::stable_sort(all.begin(), all.end(),
                     [&](const auto& a, const auto& b) { return size(a) < size(b); });
  }
  FrictionSolution& found = all.front();
  FrictionalImpact impact;
  impact.springs = found.springs;
  impact.result.v_plus = frame.VelocityAfter(inertia, v_minus, &found);
  impact.result.impulse = frame.Impulse(inertia, found.force);
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    if (found.letters[k] == Letter::kOpen) continue;
    const bool free = problem.contacts[k].dimension == 0;
    impact.word.Set(frame.constraints()[k], free ? Letter::kSlip : found.letters[k]);
    impact.result.hit.Insert(frame.constraints()[k]);
  }
  impact.energy_change = 0.5 * found.force.dot(before + frame.rows() * impact.result.v_plus);
  // Beside what surfaces that are driven may give, too.
  const double energy =
      KineticEnergy(inertia.mass(), v_minus) + found.force.cwiseAbs().dot(before.cwiseAbs());
  if (impact.energy_change > kEnergyRounding * energy) {
    std::ostringstream message;
    message << "the impact of the contacts " << names << " would add " << impact.energy_change
            << " J (Newton's restitution with friction)";
    throw FrictionRefusal(FrictionRefusal::Kind::kEnergyGain, message.str());
  }
  if (!impact.result.v_plus.allFinite()) {
    throw std::domain_error("the velocity after the impact is not finite");
  }
  return impact;
}

}  // namespace contact_flow
