// SPDX-License-Identifier: BSD-3-Clause
// Passive walkers: gaits by FindOrbit, eigenvalues of their return maps, certificates. A step ends
// with the legs exchanged and further on (ReturnSymmetry).
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "contact_flow/analysis/periodic_orbit.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/stability.h"

namespace contact_flow {
namespace {

using Complex = std::complex<double>;

/// Behind the touchdown of a foot, the legs exchanged.
Section HeelStrike(const MechanicalSystem& walker) {
  Section section = Section::Event(walker, "right_foot");
  section.symmetry.Exchange(walker, "left_leg", "right_leg").Travel(walker, {"hip_x"});
  return section;
}

OrbitSolution FindGait(const std::string& name, const ParameterValues& parameters,
                       const Section& section, const Vector& x, double horizon) {
  OrbitProblem problem;
  problem.factory = [name](const ParameterValues& values) { return MakeModel(name, values); };
  problem.parameters = parameters;
  problem.section = section;
  problem.x = x;
  problem.u = Vector::Zero(0);
  OrbitOptions options;
  options.poincare.horizon = horizon;
  options.poincare.shortest = 0.01;
  return FindOrbit(problem, options);
}

/// Of largest modulus first, those of pairs by their imaginary part.
std::vector<Complex> Eigenvalues(const PiecewiseLinearMap& map) {
  EXPECT_EQ(1u, map.pieces().size());
  const Eigen::VectorXcd values = map.pieces()[0].matrix.eigenvalues();
  std::vector<Complex> sorted(values.data(), values.data() + values.size());
  std::sort(sorted.begin(), sorted.end(), [](Complex a, Complex b) {
    return std::abs(std::abs(a) - std::abs(b)) > 1e-9 ? std::abs(a) > std::abs(b)
                                                      : a.imag() > b.imag();
  });
  return sorted;
}

void ExpectStable(const PiecewiseLinearMap& map) {
  const StabilityReport report = AssessStability(map);
  EXPECT_EQ(StabilityVerdict::kStable, report.verdict) << report.message;
  EXPECT_TRUE(VerifyCertificate(map, report.certificate));
}

struct Wheel {
  double eigenvalue, speed;
};

Wheel RollingWheel(double inertia) {
  const auto wheel = MakeModel("rimless_wheel", {{"inertia", inertia}});
  Section section = Section::Event(*wheel, "spoke_2");
  section.symmetry.Shift(*wheel, "angle", -M_PI / 4).Travel(*wheel, {"hub_x"});
  Vector x = wheel->nominal().x;
  x.tail(3) *= 1.1;
  const OrbitSolution gait = FindGait("rimless_wheel", {{"inertia", inertia}}, section, x, 5);
  EXPECT_TRUE(gait.ok()) << gait.newton.message;
  EXPECT_EQ(ReturnStatus::kReturned, gait.orbit.status) << gait.orbit.message;
  const PiecewiseLinearMap& map = gait.orbit.reduced;
  EXPECT_EQ(1, map.rows());
  ExpectStable(map);
  const double cosine = std::cos(M_PI / 4), eta = (cosine + inertia) / (1 + inertia);
  const double gain = 4 * 9.81 * std::sin(M_PI / 8) * std::sin(0.08) / (1 + inertia);
  EXPECT_NEAR(eta * eta, map.pieces()[0].matrix(0, 0), 1e-9) << inertia;
  EXPECT_NEAR(eta * std::sqrt(gain / (1 - eta * eta)), gait.x(5), 1e-9) << inertia;
  return {map.pieces()[0].matrix(0, 0), gait.x(5)};
}

/// The value at 0 of the cubic through those at h, 2h, 3h, 4h.
template <class Value>
Value AtZero(const std::vector<Value>& at) {
  return 4.0 * at[0] - 6.0 * at[1] + 4.0 * at[2] - at[3];
}

/// Where the rim is light beside the hub the Delassus matrix of a foot has the condition m l²/I.
TEST(Walkers, RimlessWheel) {
  for (const double inertia : {0.3, 1e-2, 1e-4, 1e-6, 1e-8}) RollingWheel(inertia);
  // With massless spokes, but for 1e-10.
  const Wheel wheel = RollingWheel(1e-10);
  EXPECT_NEAR(0.5, wheel.eigenvalue, 1e-9);
  EXPECT_NEAR(1.095462840, wheel.speed, 1e-9);
}

/// Both feet on the ground, the left one ahead and at rest: z = (its angle, its rate, the other's).
Vector HeelStrikeState(const Vector& z) {
  Vector x(8);
  x << -std::sin(z(0)), std::cos(z(0)), z(0), -z(0), -std::cos(z(0)) * z(1), -std::sin(z(0)) * z(1),
      z(1), z(2);
  return x;
}
Vector ChartOf(const Vector& x) {
  Vector z(3);
  z << x(2), x(6), x(7);
  return z;
}

OrbitSolution CompassGait() {
  const auto walker = MakeModel("compass_walker");
  Vector z = ChartOf(walker->nominal().x);
  z(0) *= 1.01;
  z(1) *= 1.02;
  z(2) *= 0.95;
  return FindGait("compass_walker", {}, HeelStrike(*walker), HeelStrikeState(z), 3);
}

/// Goswami, Thuilot and Espiau, INRIA RR-2996, 3 degrees; two independent programs agree on the
/// digits given.
TEST(Walkers, CompassGait) {
  const OrbitSolution gait = CompassGait();
  ASSERT_TRUE(gait.ok()) << gait.newton.message;
  ASSERT_EQ(ReturnStatus::kReturned, gait.orbit.status) << gait.orbit.message;
  const double slope = 3 * M_PI / 180;  // the model's angles are from the ground's normal
  EXPECT_NEAR(-0.323388558, gait.x(3) - slope, 1e-9);
  EXPECT_NEAR(0.218668803, gait.x(2) - slope, 1e-9);
  EXPECT_NEAR(-0.377373949, gait.x(7), 1e-9);
  EXPECT_NEAR(-1.092383590, gait.x(6), 1e-9);
  EXPECT_NEAR(0.734346391, gait.orbit.time, 1e-9);
  EXPECT_LE(gait.orbit.symmetry_residual, 1e-12);
  const std::vector<Complex> values = Eigenvalues(gait.orbit.reduced);
  ASSERT_EQ(3u, values.size()) << "the dimensions of the heel strike, no zero beside";
  EXPECT_NEAR(0, std::abs(values[0] - Complex(-0.199726, 0.544476)), 1e-6);
  EXPECT_NEAR(0, std::abs(values[1] - Complex(-0.199726, -0.544476)), 1e-6);
  EXPECT_NEAR(0, std::abs(values[2] - Complex(0.131573, 0)), 1e-6);
  ExpectStable(gait.orbit.reduced);
}

/// DP in the chart beside central differences of simulated steps: with h = 1e-5 their error is
/// h² times third derivatives (below 100), and some 1e-12/h of the runs.
TEST(Walkers, ReturnMapAgreesWithQuotients) {
  const auto walker = MakeModel("compass_walker");
  PoincareOptions options;
  options.shortest = 0.01;
  const PoincareMap map(*walker, Vector::Zero(0), HeelStrike(*walker), options);
  Vector z(3);
  z << 0.28, -1.1, -0.35;  // off the gait
  const PoincareReturn base = map.Return(HeelStrikeState(z));
  ASSERT_EQ(ReturnStatus::kReturned, base.status) << base.message;
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 3; ++k) {
    const Vector step = kStep * Vector::Unit(3, k);
    const PoincareReturn plus = map.Return(HeelStrikeState(z + step), false);
    const PoincareReturn minus = map.Return(HeelStrikeState(z - step), false);
    const Vector w = (HeelStrikeState(z + step) - HeelStrikeState(z - step)) / (2 * kStep);
    const Vector quotient = ChartOf(plus.x - minus.x) / (2 * kStep);
    EXPECT_LE((ChartOf(base.map(w)) - quotient).cwiseAbs().maxCoeff(), 1e-6) << k;
    EXPECT_NEAR((plus.time - minus.time) / (2 * kStep), base.return_time(w)(0), 1e-6) << k;
  }
}

/// The same gait where the stance leg is upright, and over two steps without any exchange.
TEST(Walkers, TwoStepsAreOneSquared) {
  const auto walker = MakeModel("compass_walker");
  const OrbitSolution gait = CompassGait();
  ASSERT_TRUE(gait.ok());
  const PoincareReturn upright =
      PoincareMap(*walker, Vector::Zero(0), Section::Coordinate(*walker, "left_leg", 0, -1))
          .Return(gait.x, false);
  ASSERT_EQ(ReturnStatus::kReturned, upright.status) << upright.message;
  Section one = Section::Coordinate(*walker, "right_leg", 0, -1);
  one.symmetry.Exchange(*walker, "left_leg", "right_leg").Travel(*walker, {"hip_x"});
  Section two = Section::Coordinate(*walker, "left_leg", 0, -1);
  two.symmetry.Travel(*walker, {"hip_x"});
  const OrbitSolution step = FindGait("compass_walker", {}, one, upright.x, 3);
  const OrbitSolution steps = FindGait("compass_walker", {}, two, upright.x, 3);
  ASSERT_TRUE(step.ok()) << step.newton.message;
  ASSERT_TRUE(steps.ok()) << steps.newton.message;
  EXPECT_NEAR(0.734346391, step.orbit.time, 1e-9);
  EXPECT_NEAR(2 * 0.734346391, steps.orbit.time, 2e-9);
  const std::vector<Complex> values = Eigenvalues(gait.orbit.reduced);
  const std::vector<Complex> once = Eigenvalues(step.orbit.reduced);
  const std::vector<Complex> twice = Eigenvalues(steps.orbit.reduced);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(0, std::abs(once[k] - values[k]), 1e-8);
    const Complex square = values[k] * values[k];
    EXPECT_NEAR(0, std::min(std::abs(twice[k] - square), std::abs(twice[k] - std::conj(square))),
                1e-8);
  }
  ExpectStable(step.orbit.reduced);
  ExpectStable(steps.orbit.reduced);
}

/// Parameters and times of events among the unknowns and conditions: Newton's quadratic convergence
/// holds where their derivatives are right.
TEST(Walkers, SlopeThatGivesAPeriodOrTheTimeOfAnEvent) {
  const auto walker = MakeModel("compass_walker");
  OrbitProblem problem;
  problem.factory = [](const ParameterValues& values) {
    return MakeModel("compass_walker", values);
  };
  problem.unknown_parameters = {"slope"};
  problem.section = HeelStrike(*walker);
  problem.x = walker->nominal().x;
  problem.u = Vector::Zero(0);
  problem.conditions = {{OrbitCondition::Kind::kPeriod, 0, 0.73}};
  OrbitOptions options;
  options.poincare.shortest = 0.01;
  const OrbitSolution periodic = FindOrbit(problem, options);
  ASSERT_TRUE(periodic.ok()) << periodic.newton.message;
  EXPECT_LE(periodic.newton.iterations.size(), 8u);
  EXPECT_NEAR(0.73, periodic.orbit.time, 1e-10);
  EXPECT_GT(std::abs(periodic.parameters.at("slope") - 3 * M_PI / 180), 1e-4);
  const OrbitSolution again =
      FindGait("compass_walker", periodic.parameters, problem.section, walker->nominal().x, 3);
  ASSERT_TRUE(again.ok()) << again.newton.message;
  EXPECT_NEAR(0.73, again.orbit.time, 1e-9);

  problem.section = Section::Coordinate(*walker, "right_leg", 0, -1);
  problem.section.symmetry.Exchange(*walker, "left_leg", "right_leg").Travel(*walker, {"hip_x"});
  const PoincareReturn upright =
      PoincareMap(*walker, Vector::Zero(0), Section::Coordinate(*walker, "left_leg", 0, -1))
          .Return(walker->nominal().x, false);
  ASSERT_TRUE(upright.returned());
  problem.x = upright.x;
  const double time = 0.734346391 - upright.time;  // of the heel strike, from there
  problem.conditions = {{OrbitCondition::Kind::kTouchdown, 1, 1.005 * time}};
  const OrbitSolution timed = FindOrbit(problem, options);
  ASSERT_TRUE(timed.ok()) << timed.newton.message;
  EXPECT_LE(timed.newton.iterations.size(), 8u);
  ASSERT_EQ(1u, timed.orbit.trajectory.transitions.size());
  EXPECT_NEAR(1.005 * time, timed.orbit.trajectory.transitions[0].t, 1e-10);
}

TEST(Walkers, WhatIsNoSymmetryIsRefused) {
  const auto walker = MakeModel("compass_walker");
  PoincareOptions options;
  options.shortest = 0.01;
  Section section = Section::Event(*walker, "right_foot");
  section.symmetry.Travel(*walker, {"hip_z"});
  const PoincareReturn lifted = PoincareMap(*walker, Vector::Zero(0), section, options)
                                    .Return(HeelStrikeState(Eigen::Vector3d(0.27, -1.1, -0.35)));
  EXPECT_EQ(ReturnStatus::kRefused, lifted.status);
  EXPECT_NE(std::string::npos, lifted.message.find("symmetry")) << lifted.message;
  ReturnSymmetry symmetry;
  EXPECT_THROW(symmetry.Exchange(*walker, "left_leg", "left_leg"), std::invalid_argument);
  EXPECT_THROW(symmetry.Exchange(*walker, "left_leg", "right_lg"), std::invalid_argument);
  symmetry.Exchange(*walker, "left_leg", "right_leg");
  EXPECT_THROW(symmetry.Exchange(*walker, "left_leg", "hip_x"), std::invalid_argument);
}

struct Simplest {
  double angle, rate;
  std::vector<Complex> eigenvalues;
};

/// Two eigenvalues, and a third that vanishes with the masses of the legs.
Simplest SimplestGait(double leg_mass, double angle, double rate, StabilityVerdict verdict) {
  const ParameterValues parameters = {{"leg_mass", leg_mass}};
  const auto walker = MakeModel("simplest_walker", parameters);
  Vector z(3);
  z << angle, rate, rate * std::cos(2 * angle);
  const OrbitSolution gait =
      FindGait("simplest_walker", parameters, HeelStrike(*walker), HeelStrikeState(z), 6);
  EXPECT_TRUE(gait.ok()) << gait.newton.message;
  EXPECT_EQ(ReturnStatus::kReturned, gait.orbit.status) << gait.orbit.message;
  const StabilityReport report = AssessStability(gait.orbit.reduced);
  EXPECT_EQ(verdict, report.verdict) << report.message;
  EXPECT_TRUE(VerifyCertificate(gait.orbit.reduced, report.certificate));
  return {gait.x(2), gait.x(6), Eigenvalues(gait.orbit.reduced)};
}

/// Garcia et al. 1998, slope 0.009, at leg_mass = 1e-4 to 4e-4 and by the cubic through them at 0.
/// It leaves 24 coefficients of the fourth order times 1e-16, which a step of 1e-3 shows to be
/// 4e-10 for the eigenvalues; the weights carry 15 times the 1e-11 (1e-12 of a gait) of each.
TEST(Walkers, SimplestWalker) {
  std::vector<double> angle, rate;
  std::vector<Complex> first, second;
  for (int k = 1; k <= 4; ++k) {
    const Simplest gait = SimplestGait(1e-4 * k, 0.2003, -0.1998, StabilityVerdict::kStable);
    angle.push_back(gait.angle);
    rate.push_back(gait.rate);
    ASSERT_EQ(3u, gait.eigenvalues.size());
    first.push_back(gait.eigenvalues[0]);
    second.push_back(gait.eigenvalues[1]);
    EXPECT_LE(std::abs(gait.eigenvalues[2]), 1e-9);
  }
  EXPECT_NEAR(0.200310900544258, AtZero(angle), 5e-11);
  EXPECT_NEAR(-0.199832473004964, AtZero(rate), 5e-11);
  EXPECT_NEAR(0, std::abs(AtZero(first) - Complex(-0.19009984, 0.55759878)), 1e-8);
  EXPECT_NEAR(0, std::abs(AtZero(second) - Complex(-0.19009984, -0.55759878)), 1e-8);
  // With leg_mass/hip_mass = 1/1000, by the program of test/data/friction/compass_walker.json.
  const Simplest heavy = SimplestGait(1e-3, 0.2002, -0.1999, StabilityVerdict::kStable);
  EXPECT_NEAR(0, std::abs(heavy.eigenvalues[0] - Complex(-0.19666818, 0.54472677)), 1e-8);
}

/// The other, unstable gait of the same walker.
TEST(Walkers, SimplestWalkerShortPeriod) {
  std::vector<Complex> first, second;
  for (int k = 1; k <= 4; ++k) {
    const Simplest gait = SimplestGait(1e-4 * k, 0.1939, -0.2038, StabilityVerdict::kUnstable);
    first.push_back(gait.eigenvalues[0]);
    second.push_back(gait.eigenvalues[1]);
  }
  EXPECT_NEAR(0, std::abs(AtZero(first) - Complex(4.00386436, 0)), 1e-7);
  EXPECT_NEAR(0, std::abs(AtZero(second) - Complex(0.45958959, 0)), 1e-7);
}

}  // namespace
}  // namespace contact_flow
