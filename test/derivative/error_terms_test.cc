// SPDX-License-Identifier: BSD-3-Clause
// Terms of the estimated errors that random runs seldom need, beside closed forms: the instant of
// a touch that hardly comes about, and what implicit steps leave of their equations.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/derivative/error_calibration.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::Largest;

/// y = 1 + A cos(t − 1), with A² = (1 + δ)², touches the floor at t₁ with the speed s = √(A² − 1),
/// stands still for a moment and rises as 1 − cos(t − t₁). By δẏ(0) = 1 it comes by sin t₁ / s
/// later, and s follows from y at a distance of δ: an error e of it makes one of e/s² in δt₁.
TEST(ErrorTerms, OfATouchThatHardlyComesAbout) {
  const auto system = test::Make<test::Oscillator>();
  constexpr double kDuration = 6;
  int runs = 0;
  for (const double depth : {1e-2, 1e-3, 1e-4, 1e-5}) {
    const double A = 1 + depth, speed = std::sqrt(depth * (2 + depth));
    const double touch = 1 + M_PI - std::atan2(speed, 1), rest = kDuration - touch;
    Vector x(2), exact(2);
    x << 1 + A * std::cos(1.0), A * std::sin(1.0);
    exact << -std::sin(rest), -std::cos(rest);
    exact *= std::sin(touch) / speed;
    for (const double tolerance : {1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      const BDerivative B =
          DifferentiateOutcome(system, Simulate(system, x, Vector(0), kDuration, options));
      if (!B.status.ok()) {  // it cannot be told from a graze
        EXPECT_LT(depth, 1e3 * tolerance) << B.status.message;
        continue;
      }
      ++runs;
      const Vector w = Vector::Unit(2, 1);
      // Rounding of A² − 1, over it.
      const double rounding = 1e-14 / depth;
      EXPECT_LE(Largest(B(w) - exact), Largest(B.Error(w)) + rounding * Largest(exact))
          << depth << ' ' << tolerance;
    }
  }
  EXPECT_GE(runs, 12);
}

/// Implicit steps shorter than their errors ask for: what is left is that of the iteration, which
/// ends where a part of the tolerance is reached. Truth is an explicit run at 1e-13.
TEST(ErrorTerms, OfImplicitStepsThatAreNotSolvedToRounding) {
  for (const char* name : {"double_pendulum", "falling_box"}) {
    const auto system = MakeModel(name);
    const NominalRun& nominal = system->nominal();
    const auto run = [&](IntegrationMethod method, double tolerance, double max_step) {
      SimulateOptions options;
      options.method = method;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      options.max_step = max_step;
      return Simulate(*system, nominal.x, nominal.u, nominal.duration, options);
    };
    const Vector exact = run(IntegrationMethod::kExplicit, 1e-13, 0).FinalState();
    for (const double tolerance : {1e-5, 1e-6, 1e-7}) {
      for (const double steps : {30, 100}) {
        const Trajectory implicit =
            run(IntegrationMethod::kImplicit, tolerance, nominal.duration / steps);
        const BDerivative B = DifferentiateOutcome(*system, implicit);
        ASSERT_TRUE(B.status.ok()) << B.status.message;
        const double error = Largest(system->Separation(implicit.FinalState(), exact));
        // Each step rounds numbers of order 1 to 10.
        EXPECT_LE(error, Largest(B.trust.state_error) + 1e-14 * steps)
            << name << ' ' << tolerance << ' ' << steps;
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
