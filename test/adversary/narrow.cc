// SPDX-License-Identifier: BSD-3-Clause
#include "test/adversary/narrow.h"

#include <algorithm>
#include <stdexcept>

#include "contact_flow/derivative/b_derivative.h"

namespace contact_flow {
namespace adversary {
namespace {

constexpr double kStepsOfRun = 1000;

bool HasRidges(const Coefficients& c) {
  return !c.ridges.empty() ||
         std::any_of(c.gaps.begin(), c.gaps.end(), [](const auto& g) { return !g.ridges.empty(); });
}

}  // namespace

bool FoundWithMaxStep(const Case& c, const Trial& trial, const Vector& x, double off) {
  if (!HasRidges(c.system->coefficients())) return false;
  const Trajectory fine = trial.Simulated(c.duration / kStepsOfRun);
  if (!fine.status.ok()) return true;
  return (c.units.Back(fine.FinalState()) - x).cwiseAbs().maxCoeff() < 1e-3 * off;
}

bool FoundWithMaxStep(const Case& c, const Trial& trial, const Vector& w, const Vector& quotient,
                      double off) {
  if (!HasRidges(c.system->coefficients())) return false;
  const Trajectory fine = trial.Simulated(c.duration / kStepsOfRun);
  if (!fine.status.ok()) return true;
  BDerivativeOptions options;
  options.variables.inputs = true;
  options.variables.parameters = {0, 1};
  const BDerivative B = DifferentiateOutcome(trial.given(), fine, options);
  if (!B.status.ok()) return true;
  try {
    const Vector found = c.units.Back(B(trial.Given(w)));
    return (found - quotient).cwiseAbs().maxCoeff() < 0.1 * off;
  } catch (const std::domain_error&) {
    return true;
  }
}

}  // namespace adversary
}  // namespace contact_flow
