// SPDX-License-Identifier: BSD-3-Clause
// The search for an orbit in any system of units: one path of iterates, to one orbit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "contact_flow/analysis/orbit_sizes.h"
#include "contact_flow/analysis/periodic_orbit.h"
#include "contact_flow/model/model_library.h"
#include "test/adversary/rescaled_system.h"

namespace contact_flow {
namespace {

using adversary::RescaledSystem;
using adversary::Units;

/// A model in other units.
class OtherUnits : public RescaledSystem {
 public:
  OtherUnits(std::unique_ptr<MechanicalSystem> system, const Units& units)
      : RescaledSystem(*system, units), system_(std::move(system)) {}

 private:
  std::unique_ptr<MechanicalSystem> system_;
};

/// Lengths by `length`, times by `time`; the pitch is an angle.
Units TrotUnits(double length, double time) {
  Units units = Units::Same(7, 2);
  units.length.head(6) *= length;
  units.gap *= length;
  units.time = time;
  return units;
}

OrbitProblem Trot(const Units& units) {
  OrbitProblem problem;
  problem.factory = [units](const ParameterValues& values) {
    return std::make_unique<OtherUnits>(MakeModel("hopping_trot", values), units);
  };
  const auto model = MakeModel("hopping_trot", {});
  problem.x = units.State(1.03 * model->nominal().x);  // 3 % off
  problem.u = Vector(0);
  problem.section = Section::Apex(*model, "body_z");
  return problem;
}

OrbitOptions In(const Units& units) {
  OrbitOptions options;
  options.poincare.horizon *= units.time;
  options.poincare.shortest *= units.time;
  options.poincare.simulate = units.Scale(options.poincare.simulate);
  // One tolerance for lengths and angles: what is far below the rounding of either helps none.
  const double largest = units.length.maxCoeff() * std::max(1.0, 1 / units.time);
  options.poincare.simulate.absolute_tolerance =
      std::max(options.poincare.simulate.absolute_tolerance, 1e-14 * largest);
  return options;
}

/// What has been held is off its surface by the rounding of its units, which is no touchdown.
TEST(OrbitUnits, WhatLetsGoDoesNotTouchDownAgainInAny) {
  const auto model = MakeModel("hopping_trot", {});
  for (const double length : {1.0, 1e3, 1e4, 1e6}) {
    for (const double tolerance : {1e-9, 1e-10, 1e-11, 1e-12}) {
      const Units units = TrotUnits(length, 1);
      const OtherUnits trot(MakeModel("hopping_trot", {}), units);
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = tolerance;
      const Trajectory run =
          Simulate(trot, units.State(model->nominal().x), Vector(0), 0.8, options);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(2u, run.transitions.size()) << "length " << length << ", to " << tolerance;
    }
  }
}

TEST(OrbitUnits, OnePathInAny) {
  const Units same = TrotUnits(1, 1);
  const OrbitSolution natural = FindOrbit(Trot(same), In(same));
  ASSERT_TRUE(natural.ok()) << natural.newton.message;
  EXPECT_NEAR(0.8, natural.orbit.time, 1e-10);
  const std::vector<std::pair<double, double>> all = {{1e-3, 1e-2}, {1e-3, 1}, {1e3, 1e2},
                                                      {1, 1e3},     {1e-6, 1}, {1e3, 1}};
  for (const auto& [length, time] : all) {
    SCOPED_TRACE(testing::Message() << "length " << length << ", time " << time);
    const Units units = TrotUnits(length, time);
    const OrbitSolution other = FindOrbit(Trot(units), In(units));
    EXPECT_TRUE(other.ok()) << other.newton.message;
    EXPECT_NEAR(0.8, other.orbit.time / time, 1e-8);
    EXPECT_LE((units.Back(other.x) - natural.x).cwiseAbs().maxCoeff(), 1e-7);
    for (int k : {0, 1, 2}) {
      EXPECT_NEAR(1, other.newton.iterations[k].residual / natural.newton.iterations[k].residual,
                  1e-2)
          << k;
    }
  }
}

TEST(OrbitUnits, ResidualsAreInThoseOfTheSystem) {
  const Units units = TrotUnits(1e3, 1);
  OrbitProblem problem = Trot(units);
  OrbitOptions options = In(units);
  options.newton.max_iterations = 0;
  const OrbitSolution start = FindOrbit(problem, options);
  const Vector apart = start.system->Separation(start.orbit.x, start.x);
  EXPECT_GT(apart.cwiseAbs().maxCoeff(), 1);
  EXPECT_LE((start.newton.residual - apart).cwiseAbs().maxCoeff(), 1e-6);
}

/// Between two walls a ball of 2 m/s: its speed, and that times a period of 1 s.
TEST(OrbitUnits, SizesOfABall) {
  const auto ball = MakeModel("bouncing_ball", {{"gravity", 0}});
  SimulateOptions options;
  Vector x = ball->nominal().x;
  const int d = ball->dof();
  x.tail(d).setZero();
  x(d) = 2;
  const OrbitSizes sizes = SizesOf(*ball, Simulate(*ball, x, ball->nominal().u, 0.5, options));
  EXPECT_DOUBLE_EQ(0.5, sizes.time);
  EXPECT_DOUBLE_EQ(2, sizes.tangent(d));
  EXPECT_DOUBLE_EQ(1, sizes.tangent(0));
  Vector difference = Vector::Zero(2 * d);
  difference(d) = 3;
  EXPECT_DOUBLE_EQ(3 / std::max(2.0, sizes.place(d)), sizes.Compare(difference));
  EXPECT_DOUBLE_EQ(1, sizes.Of(Vector::Zero(2 * d)));
}

TEST(OrbitUnits, NothingMoves) {
  const auto ball = MakeModel("bouncing_ball", {{"gravity", 0}});
  Vector x = ball->nominal().x;
  x.tail(ball->dof()).setZero();
  const OrbitSizes sizes = SizesOf(*ball, Simulate(*ball, x, ball->nominal().u, 0.5));
  EXPECT_EQ(Vector::Ones(2 * ball->dof()), sizes.tangent);
}

/// A ball that is thrown along the floor is on its orbit but for the way it has made. One at rest
/// is where it lies, within the rounding of that.
TEST(OrbitUnits, WhatIsOnItsOrbit) {
  const auto ball = MakeModel("bouncing_ball", {{"restitution", 1}});
  const Vector u = ball->nominal().u;
  Vector x(4);
  x << 0, 1, 2, 0;
  const PoincareMap map(*ball, u, Section::Apex(*ball, "z"));
  const PoincareReturn one = map.Return(x);
  ASSERT_TRUE(one.returned()) << one.message;
  Matrix travel = Matrix::Zero(4, 2);
  travel(0, 0) = travel(2, 1) = 1;
  EXPECT_GT(OffOrbit(*ball, x, one, Matrix(4, 0)), 0.5);
  EXPECT_LE(OffOrbit(*ball, x, one, travel), 1e-11);
  x(1) += 1e-3;
  EXPECT_NEAR(1e-3, OffOrbit(*ball, x, one, travel), 8e-4);
  Vector still = Vector::Zero(4);
  still << 3, 0, 1e-9, 0;
  const PoincareReturn rest = PoincareMap(*ball, u, Section::After(0.5)).Return(still);
  ASSERT_TRUE(rest.returned()) << rest.message;
  EXPECT_LE(OffOrbit(*ball, still, rest, Matrix(4, 0)), 1e-9);
}

}  // namespace
}  // namespace contact_flow
