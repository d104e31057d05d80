// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity of the reference runs against the size at which the sequence of words
// changes, found by bisection.
#include "contact_flow/analysis/validity_radius.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/friction/friction_case.h"
#include "test/friction/systems/two_wheels.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;

using Limit = ValidityRadius::Limit;
constexpr double kSmall = 2e-3;  // the sequence of a direction is that of this size
constexpr double kLarge = 0.5;   // changes are looked for up to here
constexpr int kSizes = 30;

/// The words that a run passes through; none where it is refused or ends before.
std::vector<ContactMode> WordsFrom(const MechanicalSystem& system, const Vector& x,
                                   double duration) {
  try {
    const Trajectory run = Simulate(system, x, system.nominal().u, duration, AtTolerance(1e-11));
    if (run.status.ok()) return run.ModeSequence();
  } catch (const std::invalid_argument&) {
  }
  return {};
}

/// One for each arc, for messages; empty where the run is refused.
std::string Text(const std::vector<ContactMode>& words, int n) {
  std::string text;
  for (const ContactMode& word : words) text += word.Word(n) + ' ';
  return text;
}

class FrictionRadius : public testing::TestWithParam<std::string> {};

/// As without friction (RadiusByBisection): at the distance m from the first change the radius is
/// m, to first order in m, where one guard passes zero.
TEST_P(FrictionRadius, IsTheDistanceToTheFirstChange) {
  const test::FrictionCase c(GetParam());
  int found = 0, close = 0;
  std::map<std::string, int> limits;
  for (const auto& d : c.derivatives) {
    const Vector w = d.direction / d.direction.cwiseAbs().maxCoeff();
    const auto words = [&](double alpha) {
      return WordsFrom(*c.system, c.system->Perturb(c.x, alpha * w), c.duration);
    };
    const std::vector<ContactMode> base = words(kSmall);
    double low = kSmall, high = 0;
    for (int i = 1; i <= kSizes && high == 0 && !base.empty(); ++i) {
      const double alpha = kSmall * std::pow(kLarge / kSmall, i / (1.0 * kSizes));
      (words(alpha) == base ? low : high) = alpha;
    }
    if (high == 0) continue;
    while (high - low > 1e-9) {
      const double middle = (low + high) / 2;
      (words(middle) == base ? low : high) = middle;
    }
    // A start that leaves its contacts, by α², is another run.
    const std::vector<ContactMode> beyond = words(high);
    if (beyond.empty() || beyond.front().Members() != base.front().Members()) continue;
    const double margin = 1e-3 * high;
    const Vector near = c.system->Perturb(c.x, (high - margin) * w);
    Trajectory run;
    try {
      run = Simulate(*c.system, near, c.u, c.duration, AtTolerance(1e-11));
    } catch (const std::invalid_argument&) {
      continue;  // off the contacts of the start, by α²
    }
    const BDerivative B = DifferentiateOutcome(*c.system, run);
    if (!B.status.ok()) continue;
    const ValidityRadius radius = ValidityEstimator(*c.system, run, B)(w);
    const double ratio = radius.radius / margin;
    const int n = c.system->num_constraints();
    EXPECT_TRUE(ratio > 0.2 && ratio < 1.5)
        << w.transpose() << " goes from " << Text(base, n) << "to " << Text(beyond, n) << "at "
        << high << "; the radius is " << ratio << " of the distance, as "
        << Describe(c.system->description(), radius);
    ++found;
    close += std::abs(ratio - 1) < 0.1;
    ++limits[LimitName(radius.limit)];
  }
  EXPECT_GE(close, 0.6 * found);
  for (const auto& [limit, count] : limits) RecordProperty(limit, count);
  RecordProperty("found", found);
  RecordProperty("close", close);
}

INSTANTIATE_TEST_SUITE_P(Cases, FrictionRadius, testing::ValuesIn(test::FrictionCaseNames()),
                         [](const auto& info) { return info.param; });

/// A run that ends within the tolerances before a touchdown holds for the time that is left: a ball
/// whose start is lower by α lands before the end from α = −ż (t − T) on.
TEST(FrictionRadius, EndsWhereATouchdownComesIntoTheRun) {
  const auto ball = MakeModel("spinning_ball");
  const Vector x = ball->nominal().x;
  const Trajectory whole = Simulate(*ball, x, ball->nominal().u, 1, AtTolerance(1e-11));
  const Transition& touchdown = whole.transitions.at(0);
  const int d = ball->dof();
  const int z = static_cast<int>(
      std::find(ball->description().velocities.begin(), ball->description().velocities.end(), "z") -
      ball->description().velocities.begin());
  ASSERT_LT(z, d);
  const double speed = -touchdown.x_minus(ball->num_positions() + z);
  for (const double left : {1e-6, 1e-9, 1e-11, 1e-13}) {
    const Trajectory run =
        Simulate(*ball, x, ball->nominal().u, touchdown.t - left, AtTolerance(1e-11));
    ASSERT_TRUE(run.status.ok() && run.transitions.empty());
    const BDerivative B = DifferentiateOutcome(*ball, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const ValidityEstimator radius(*ball, run, B);
    const ValidityRadius lower = radius(-Vector::Unit(2 * d, z));
    EXPECT_NEAR(speed * left, lower.radius, 1e-3 * speed * left + 1e-14);
    EXPECT_EQ(Limit::kHorizon, lower.limit);
    EXPECT_TRUE(std::isinf(radius(Vector::Unit(2 * d, z)).radius));
  }
}

/// A wheel bounces and slips through its impact, which takes (1 + e) v μ (1 + r²/I) of its slip:
/// with so much less at the start it sticks in the impact.
TEST(FrictionRadius, EndsWhereASlippingImpactWouldStick) {
  using test::TwoWheels;
  const auto wheels = MakeSystem<TwoWheels>({{"restitution", 0.5}});
  const double height = 0.05, fall = std::sqrt(2 * test::kGravity * height);
  const double inertia = TwoWheels::kRadius * TwoWheels::kRadius / TwoWheels::kInertia;
  const double taken = 1.5 * fall * TwoWheels::kMu * (1 + inertia);
  for (const double left : {0.1, 0.02, 0.002, -0.02}) {
    const Vector x = Entries({0, height, 0, 0, 10, 0, taken + left, 0, 0, 0, 0, 0});
    const Trajectory run = Simulate(*wheels, x, Vector(0), 0.15, AtTolerance(1e-11));
    ASSERT_EQ(1u, run.transitions.size());
    const BDerivative B = DifferentiateOutcome(*wheels, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    const ValidityEstimator radius(*wheels, run, B);
    const ValidityRadius found = radius(Vector::Unit(12, 6) * (left > 0 ? -1 : 1));
    EXPECT_EQ(Limit::kImpulseCone, found.limit) << left;
    EXPECT_NEAR(std::abs(left), found.radius, 1e-6) << left;
  }
}

/// Slips in space that end, and impulses that contacts share, have no margins of their own: what
/// differences tell of them is rounding, which another tolerance changes.
TEST(RadiusOfReference, IsTheSameAtAnyTolerance) {
  struct Case {
    const char* model;
    ParameterValues parameters;
    Vector x, w;
    double duration;
  };
  const Case cases[] = {
      {"puck",
       {{"friction", 0.25}, {"force_x", -0.067}},
       Entries({0, 0, 0, 0.77, 0.67, 0}),
       Vector::Unit(6, 4),
       2},
      {"sliding_rod",
       {{"half_length", 0.44760840223521065}, {"friction", 0.05}},
       Entries({-0.0007692088597777318, 0.4898494223531203, 0.20185098089136078,
                -0.002170977443716599, -0.00017157144103432148, 0.0017272061102506786}),
       Vector::Unit(6, 2),
       0.57},
  };
  for (const Case& of : cases) {
    const auto system = MakeModel(of.model, of.parameters);
    std::vector<double> radii;
    for (const double tolerance : {1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
      const Trajectory run =
          Simulate(*system, of.x, system->nominal().u, of.duration, AtTolerance(tolerance));
      const BDerivative B = DifferentiateOutcome(*system, run);
      ASSERT_TRUE(B.status.ok()) << of.model << ": " << B.status.message;
      radii.push_back(ValidityEstimator(*system, run, B)(of.w).radius);
      EXPECT_NEAR(radii.front(), radii.back(), 1e-4 * radii.front()) << of.model << tolerance;
    }
    EXPECT_GT(radii.front(), 0.1) << of.model;
  }
}

}  // namespace
}  // namespace contact_flow
