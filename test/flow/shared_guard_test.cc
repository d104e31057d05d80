// SPDX-License-Identifier: BSD-3-Clause
// The first zero of a margin of shared forces on a step.
#include "src/flow/shared_guard.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace contact_flow {
namespace {

/// A margin that is straight in the forces but for what `value` says.
LocatedEvent Located(const std::function<double(double)>& value) {
  LocatedEvent event;
  SearchSharedMargin(
      3, 1e-9,
      [&](double theta) {
        return SharedMargin{theta, value(theta), Vector::Constant(1, value(theta)),
                            Vector::Ones(1)};
      },
      &event);
  return event;
}

TEST(SharedGuard, FindsTheFirstZero) {
  const LocatedEvent event = Located([](double theta) { return 0.3 - theta; });
  ASSERT_TRUE(event.found);
  EXPECT_EQ(3, event.constraint);
  EXPECT_NEAR(0.3, event.theta, 1e-12);
  EXPECT_FALSE(Located([](double theta) { return 0.3 + theta; }).found);
}

/// What was taken for admissible at the begin and rises is no event; where it falls again is one.
TEST(SharedGuard, BelowZeroAtTheBeginAlone) {
  EXPECT_FALSE(Located([](double theta) { return theta - 1e-6; }).found);
  const LocatedEvent event =
      Located([](double theta) { return theta < 0.5 ? theta - 1e-6 : 0.8 - theta; });
  ASSERT_TRUE(event.found);
  EXPECT_NEAR(0.8, event.theta, 1e-12);
  EXPECT_EQ(0, Located([](double theta) { return -1e-6 - theta; }).theta);
}

}  // namespace
}  // namespace contact_flow
