// SPDX-License-Identifier: BSD-3-Clause
// Contacts are held by accelerations; that does not let them drift away.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// A point that slides without friction in a bowl y = x²/2 swings for ever.
struct Bowl : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "bowl";
  static constexpr bool kAffineConstraints = false;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"bowl"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-10.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1) - 0.5 * q(0) * q(0);
  }
};

double Gap(const MechanicalSystem& system, const Vector& x) {
  ConstraintTerms terms;
  system.Constraints(x.head(system.num_positions()), x.tail(system.dof()), &terms);
  return terms.gap(0);
}

/// Gaps stay within the tolerance, however long the run; so its end may be a start.
TEST(Drift, LongRunsStayOnTheirContacts) {
  const auto system = test::Make<Bowl>();
  Vector x(4);
  x << 0.8, 0.32, 0, 0;
  for (const double tolerance : {1e-6, 1e-9}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    options.max_steps = 1000000;
    const Trajectory run = Simulate(system, x, Vector(0), 300, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_LT(std::abs(Gap(system, run.FinalState())), tolerance);
    options.gap_tolerance = 10 * tolerance;
    EXPECT_NO_THROW(Simulate(system, run.FinalState(), Vector(0), 0.1, options));
  }
}

/// A start whose contact closes or opens within the speed tolerance is a start at rest on it.
TEST(Drift, StartsWithinTheToleranceAreHeld) {
  const auto system = test::Make<Bowl>();
  for (const double speed : {-9e-7, 9e-7}) {
    Vector x = Vector::Zero(4);
    x(3) = speed;
    const Trajectory run = Simulate(system, x, Vector(0), 100);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    EXPECT_EQ(ContactMode({0}), run.arcs.back().mode);
    // A first step of at most a second at that speed.
    EXPECT_LT(std::abs(Gap(system, run.FinalState())), 1e-9);
  }
}

/// … and a slip within it is none: the block stays where it is.
TEST(Drift, WhatSticksDoesNotCreep) {
  const auto system = MakeModel("block_on_incline");
  Vector x = Vector::Zero(system->state_size());
  x(system->num_positions()) = 9e-7;
  const Trajectory run = Simulate(*system, x, Vector::Zero(system->num_inputs()), 100);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_LT(std::abs(run.FinalState()(0)), 1e-6);
}

}  // namespace
}  // namespace contact_flow
