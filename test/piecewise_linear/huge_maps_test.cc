// SPDX-License-Identifier: BSD-3-Clause
// Stability of maps whose squares are beyond the numbers there are.
#include <gtest/gtest.h>

#include "contact_flow/piecewise_linear/stability.h"
#include "src/piecewise_linear/common_quadratic_norm.h"

namespace contact_flow {
namespace {

/// Squares of entries from 1e154 on are beyond the numbers there are.
TEST(HugeMaps, RatesOfHugeAndTinyMaps) {
  for (const double size : {1e-300, 1e-160, 1.0, 1e153, 1e155, 1e200, 1e300}) {
    const Matrix A = size * Matrix::Identity(2, 2);
    EXPECT_NEAR(1, QuadraticRate({A}, Matrix::Identity(2, 2)) / size, 1e-12) << size;
    const StabilityReport report = AssessStability(PiecewiseLinearMap::Linear(A));
    if (size < 1) EXPECT_EQ(StabilityVerdict::kStable, report.verdict) << size;
    if (size > 1) EXPECT_NE(StabilityVerdict::kStable, report.verdict) << size;
  }
}

}  // namespace
}  // namespace contact_flow
