// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "contact_flow/trajectory_optimization/optimize_trajectory.h"

namespace contact_flow {
namespace test {

/// The cost of the run of unknowns y, whose events are told apart at 1e-12 s.
inline double CostAt(const Unknowns& unknowns, const Vector& y) {
  const Trajectory run = unknowns.Run(y, 1e-12, true);
  EXPECT_TRUE(run.status.ok()) << run.status.message;
  return unknowns.Cost(y, run);
}

}  // namespace test
}  // namespace contact_flow
