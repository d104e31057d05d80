// SPDX-License-Identifier: BSD-3-Clause
// One motion in two systems of units has one derivative, and one estimate of its error.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "test/adversary/directions.h"
#include "test/adversary/generator.h"
#include "test/adversary/trial.h"

namespace contact_flow {
namespace adversary {
namespace {

/// In units of order 1.
struct Answer {
  Vector derivative, error;
};

std::optional<Answer> Ask(const Case& c) {
  const Trial trial(c);
  const Trajectory run = trial.Simulated(std::numeric_limits<double>::infinity());
  if (!run.status.ok()) return std::nullopt;
  BDerivativeOptions options;
  options.variables.inputs = true;
  options.variables.parameters = {0, 1};
  const BDerivative B = DifferentiateOutcome(trial.given(), run, options);
  if (!B.status.ok()) return std::nullopt;
  std::string doubt;
  const Vector w = trial.Given(Directions(c).Next(0, trial.InitialMode(&doubt)));
  return Answer{c.units.Back(B(w)), c.units.Back(B.Error(w))};
}

/// The absolute tolerance is a length, which `Scale` gives to the first coordinate's unit; other
/// coordinates have other steps, and error estimates that differ by these.
constexpr double kSameError = 300, kRounding = 1e-8;

TEST(Units, DoNotChangeTheAnswer) {
  int cases = 0, unlike = 0;
  for (std::uint64_t seed = 1; seed < 600; ++seed) {
    const Case given = Generate(seed);
    const bool gusts = given.generator.find("gusts") != std::string::npos;
    if (!given.skipped.empty() || gusts || given.units.length.isOnes(0)) continue;
    Case plain = given;
    plain.units = Units::Same(given.system->dof(), given.system->num_constraints());
    try {
      const std::optional<Answer> here = Ask(given), there = Ask(plain);
      if (!here || !there) continue;
      ++cases;
      const double size = std::max(1.0, there->derivative.cwiseAbs().maxCoeff());
      EXPECT_LT((here->derivative - there->derivative).cwiseAbs().maxCoeff(), 1e-5 * size)
          << "seed " << seed;
      const double mine = here->error.maxCoeff() / size + kRounding;
      const double other = there->error.maxCoeff() / size + kRounding;
      unlike += std::max(mine / other, other / mine) > kSameError;
    } catch (const std::invalid_argument&) {  // a start that leaves its contacts by rounding
    } catch (const std::domain_error&) {      // a direction that the start does not admit
    }
  }
  EXPECT_GT(cases, 40);
  EXPECT_LE(unlike, cases / 50);
}

}  // namespace
}  // namespace adversary
}  // namespace contact_flow
