// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"

namespace contact_flow {
namespace test {

/// Three quotients along w beside B(w): slope 1, or errors that the tolerance of the runs explains.
inline void ExpectConfirmed(const QuotientReport& report, const BDerivative& B, const Vector& w) {
  const double large = 1 + B(w).cwiseAbs().maxCoeff();
  ASSERT_TRUE(report.samples[2].status.ok()) << report.samples[2].status.message;
  EXPECT_LT(report.samples[2].error, 1e-2 * large) << w.transpose();
  EXPECT_TRUE(std::abs(report.slope - 1) < 0.1 || report.samples[0].error < 1e-6 * large)
      << w.transpose() << ": slope " << report.slope << ", errors " << report.samples[0].error
      << ' ' << report.samples[1].error << ' ' << report.samples[2].error;
}

}  // namespace test
}  // namespace contact_flow
