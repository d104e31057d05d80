// SPDX-License-Identifier: BSD-3-Clause
// Drives that are limited, beside closed forms: what is passed, the end, and its derivative.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <vector>

#include "contact_flow/flow/corner_functions.h"
#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace test {

using Real = long double;
using RealState = std::array<Real, 2>;  // (x, v)

/// Explicit and implicit ones: calls check(options) at 1e-12 for each.
template <class Check>
void ByBothMethods(Check&& check) {
  for (const IntegrationMethod method :
       {IntegrationMethod::kExplicit, IntegrationMethod::kImplicit}) {
    SimulateOptions options = Tight();
    options.method = method;
    check(options);
  }
}

/// A run of a system with one joint: its end, and what it passes on the way, all in one arc.
inline void ExpectPassings(const RobotSystem& system, double duration, const RealState& end,
                           const std::vector<LimitPassing>& expected) {
  ByBothMethods([&](const SimulateOptions& options) {
    const Trajectory run =
        Simulate(system, system.nominal().x, system.nominal().u, duration, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_NEAR(static_cast<double>(end[0]), run.FinalState()(0), 1e-11);
    EXPECT_NEAR(static_cast<double>(end[1]), run.FinalState()(1), 1e-11);
    ASSERT_EQ(1u, run.arcs.size());  // no event of contacts
    const std::vector<LimitPassing> passings = LimitPassings(system, run.arcs[0]);
    ASSERT_EQ(expected.size(), passings.size());
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(expected[k].t, passings[k].t, 1e-11);
      EXPECT_EQ(expected[k].effort, passings[k].effort);
      EXPECT_EQ(expected[k].before, passings[k].before);
      EXPECT_EQ(expected[k].after, passings[k].after);
    }
  });
}

/// By each of `count` numbers, by central quotients of a closed form: run(c, h) has number c larger
/// by h.
inline Matrix QuotientsOf(int count, const std::function<RealState(int, Real)>& run) {
  const Real h = 1e-6L;
  Matrix derivative(2, count);
  for (int c = 0; c < count; ++c) {
    const RealState plus = run(c, h), minus = run(c, -h);
    for (std::size_t r = 0; r < 2; ++r) {
      derivative(static_cast<Eigen::Index>(r), c) =
          static_cast<double>((plus[r] - minus[r]) / (2 * h));
    }
  }
  return derivative;
}

/// By x, v and parameters.
inline void ExpectDerivative(const RobotSystem& system, double duration, const Matrix& expected,
                             const BDerivativeOptions& by) {
  ByBothMethods([&](const SimulateOptions& options) {
    const Trajectory run =
        Simulate(system, system.nominal().x, system.nominal().u, duration, options);
    const BDerivative B = DifferentiateOutcome(system, run, by);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    for (int c = 0; c < expected.cols(); ++c) {
      const Vector column = B(Vector::Unit(expected.cols(), c)).head(2);
      EXPECT_LT((column - expected.col(c)).norm(), 1e-10) << c;
    }
  });
}

}  // namespace test
}  // namespace contact_flow
