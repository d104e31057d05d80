// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits: the hopping trot through simultaneous touchdown and lift-off from far away,
// orbits known in closed form, order of convergence on and off the kink, and what long simulation
// says of their stability.
#include "contact_flow/analysis/periodic_orbit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "contact_flow/budget.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/section.h"
#include "contact_flow/piecewise_linear/stability.h"
#include "test/model/robots.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using Kind = OrbitCondition::Kind;
using test::ReferenceCase;

const std::vector<std::string> kUnknown = {"axial_stiffness", "axial_damping", "push",
                                           "leg_length"};

ParameterValues ParametersOf(const MechanicalSystem& system) {
  ParameterValues values;
  for (const Parameter& parameter : system.description().parameters) {
    values[parameter.name] = parameter.value;
  }
  return values;
}

OrbitProblem TrotProblem(const ReferenceCase& trot) {
  OrbitProblem problem;
  problem.factory = [](const ParameterValues& values) { return MakeModel("hopping_trot", values); };
  problem.parameters = ParametersOf(*trot.system);
  problem.section = Section::Apex(*trot.system, "body_z");
  problem.x = trot.x;
  problem.u = trot.u;
  return problem;
}

/// Apex 0.8 m, period 0.8 s, both feet down at 0.1 s and up at 0.7 s.
std::vector<OrbitCondition> TrotConditions() {
  return {{Kind::kPeriod, 0, 0.8},     {Kind::kCoordinate, 3, 0.8}, {Kind::kTouchdown, 0, 0.1},
          {Kind::kTouchdown, 0, 0, 1}, {Kind::kLiftOff, 0, 0.7},    {Kind::kLiftOff, 0, 0, 1}};
}

/// Every number that is not zero 10 % off, and those that are by 0.01; the parameters 10 % off.
/// Signs at random.
void MoveOff(std::mt19937* generator, OrbitProblem* problem) {
  const auto sign = [&] { return (*generator)() % 2 == 0 ? 0.1 : -0.1; };
  for (double& number : problem->x) {
    number += sign() * (number != 0 ? std::abs(number) : 0.1);
  }
  for (const std::string& name : kUnknown) problem->parameters[name] *= 1 + sign();
}

/// P(x) = x with the apex, period and events asked for, and the parameters of the reference.
void ExpectTheTrot(const ReferenceCase& trot, const OrbitSolution& found) {
  EXPECT_NEAR(0.8, found.orbit.time, 1e-11);
  EXPECT_NEAR(0.8, found.x(3), 1e-11);
  EXPECT_LE(found.newton.residual.cwiseAbs().maxCoeff(), 1e-11);
  // The period that is shown takes events within 1e-7 s as one: its end moves by as much as they
  // are apart.
  EXPECT_LE(found.system->Separation(found.orbit.x, found.x).cwiseAbs().maxCoeff(), 5e-11);
  const std::vector<Transition>& events = found.orbit.trajectory.transitions;
  ASSERT_EQ(2u, events.size()) << "both feet at once";
  EXPECT_EQ(2, events[0].activated.Size());
  EXPECT_EQ(2, events[1].released.Size());
  EXPECT_NEAR(0.1, events[0].t, 1e-11);
  EXPECT_NEAR(0.7, events[1].t, 1e-11);
  // An independent program found these parameters, in quadruple precision. The conditions are
  // hardly less sharp: their Jacobian's inverse is of the order of 1e3 (N/m per s).
  for (const Parameter& parameter : trot.system->description().parameters) {
    EXPECT_NEAR(parameter.value, found.parameters.at(parameter.name), 1e-8 * (1 + parameter.value));
  }
  // The orbit is a family by horizontal translation: heights, pitch and rates are the reference's.
  Vector difference = found.x - trot.x;
  for (int i : {1, 2}) difference(i) -= difference(0);
  EXPECT_LE(difference.tail(13).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(PeriodicOrbit, FindsTheTrotFromTenPercentOff) {
  const ReferenceCase trot("hopping_trot_stable");
  std::mt19937 generator(1);
  OrbitOptions options;
  options.poincare.shortest = 0.1;  // a start may rise, and pass an apex that is its own
  int possible = 0, converged = 0;
  for (int trial = 0; trial < 12; ++trial) {
    OrbitProblem problem = TrotProblem(trot);
    problem.unknown_parameters = kUnknown;
    problem.conditions = TrotConditions();
    MoveOff(&generator, &problem);
    const OrbitSolution found = FindOrbit(problem, options);
    // Some starts do not hop at all: no foot lifts off before the apex. Newton has
    // no equation then.
    if (found.newton.iterations.empty()) continue;
    ++possible;
    if (!found.ok()) {
      std::printf("trial %d: %s\n", trial, found.newton.message.c_str());
      continue;
    }
    ++converged;
    EXPECT_LE(found.newton.iterations.size(), 25u);
    ExpectTheTrot(trot, found);
  }
  std::printf("%d of %d starts that hop converge\n", converged, possible);
  EXPECT_GE(possible, 6);
  EXPECT_GE(converged, possible - 2);
}

/// Newton's residuals fall quadratically, r_{k+1} ≤ C r_k², until rounding, or until events are so
/// close (1e-7 s) that the derivative takes them as one.
void ExpectQuadratic(const NewtonResult& newton, double constant) {
  int quadratic = 0;
  for (std::size_t k = 1; k < newton.iterations.size(); ++k) {
    const double before = newton.iterations[k - 1].residual, now = newton.iterations[k].residual;
    EXPECT_LE(now, constant * before * before + 1e-10) << k;
    quadratic += before < 1 && before > 1e-9;
  }
  EXPECT_GE(quadratic, 2) << "too few iterations to tell";
}

TEST(PeriodicOrbit, ConvergesQuadraticallyOnTheKink) {
  const ReferenceCase trot("hopping_trot_stable");
  OrbitProblem problem = TrotProblem(trot);
  for (double pitch : {0.02, -0.02}) {
    problem.x = trot.x;
    problem.x(6) = pitch;
    problem.x(3) += 0.01;
    problem.x(13) = 0.05;
    const OrbitSolution found = FindOrbit(problem);
    ASSERT_TRUE(found.ok()) << found.newton.message;
    EXPECT_GE(found.orbit.map.pieces().size(), 2u) << "the orbit lies on a kink";
    EXPECT_NEAR(0, found.x(6), 1e-10);
    ExpectQuadratic(found.newton, 100);
  }
}

TEST(PeriodicOrbit, ConvergesQuadraticallyOffTheKink) {
  // The trot as a robot with its right foot further out: its feet do not land together.
  OrbitProblem problem;
  problem.factory = [](const ParameterValues& values) {
    return LoadRobot(RobotFile("hopping_trot"), values);
  };
  problem.parameters = {{"right_offset", 0.52}};
  const auto robot = problem.factory(problem.parameters);
  problem.section = Section::Apex(*robot, "base_z");
  problem.x = robot->nominal().x;
  problem.u = robot->nominal().u;
  const OrbitSolution found = FindOrbit(problem);
  ASSERT_TRUE(found.ok()) << found.newton.message;
  const std::vector<Transition>& events = found.orbit.trajectory.transitions;
  ASSERT_EQ(4u, events.size());
  EXPECT_GT(events[1].t - events[0].t, 1e-4);
  EXPECT_EQ(1u, found.orbit.map.pieces().size());
  ExpectQuadratic(found.newton, 1e3);

  // The same orbit seen just behind the touchdown that comes first, where that foot stands:
  // iterates keep its contact.
  const std::string first = robot->description().constraints[*events[0].activated.begin()];
  OrbitProblem standing = problem;
  standing.section = Section::Event(*robot, first);
  const PoincareReturn landing = PoincareMap(*robot, problem.u, standing.section).Return(found.x);
  ASSERT_TRUE(landing.returned()) << landing.message;
  standing.x = landing.x;
  standing.parameters["right_offset"] =
      0.515;  // near an orbit, and with a contact to keep, which is curved
  const OrbitSolution seen = FindOrbit(standing);
  ASSERT_TRUE(seen.ok()) << seen.newton.message;
  EXPECT_EQ(1, seen.orbit.trajectory.arcs.front().mode.Size());
  problem.parameters = standing.parameters;
  const OrbitSolution apex = FindOrbit(problem);
  ASSERT_TRUE(apex.ok()) << apex.newton.message;
  EXPECT_NEAR(apex.orbit.time, seen.orbit.time, 1e-9);
}

/// Largest deviation from the orbit's apex, horizontal motion set aside, after 50 periods; infinite
/// when it falls.
double DeviationAfterFifty(const ReferenceCase& trot, const Vector& start) {
  PoincareOptions options;
  options.simulate.relative_tolerance = options.simulate.absolute_tolerance = 1e-10;
  const PoincareMap map(*trot.system, trot.u, Section::Apex(*trot.system, "body_z"), options);
  Vector x = start;
  for (int period = 0; period < 50; ++period) {
    const PoincareReturn next = map.Return(x, false);
    if (!next.returned()) return std::numeric_limits<double>::infinity();
    x = next.x;
    Vector deviation = x - trot.x;
    for (int i : {1, 2}) deviation(i) -= deviation(0);
    if (deviation.segment(1, 6).cwiseAbs().maxCoeff() > 0.5) {
      return std::numeric_limits<double>::infinity();
    }
  }
  Vector deviation = x - trot.x;
  for (int i : {1, 2}) deviation(i) -= deviation(0);
  for (int i : {8, 9}) deviation(i) -= deviation(7);
  deviation(0) = deviation(7) = 0;
  return deviation.cwiseAbs().maxCoeff();
}

TEST(PeriodicOrbit, LongSimulationAgreesWithTheCertificates) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  for (const auto& [name, stable] :
       {std::pair("hopping_trot_stable", true), std::pair("hopping_trot_unstable", false)}) {
    const ReferenceCase trot(name);
    const PoincareReturn orbit =
        PoincareMap(*trot.system, trot.u, Section::Apex(*trot.system, "body_z")).Return(trot.x);
    ASSERT_EQ(ReturnStatus::kReturned, orbit.status) << orbit.message;
    Matrix horizontal = Matrix::Zero(14, 2);
    for (int i : {0, 1, 2}) horizontal(i, 0) = horizontal(7 + i, 1) = 1;
    const ReducedMap reduced = SetAside(orbit.reduced, orbit.start_basis.transpose() * horizontal);
    ASSERT_LE(reduced.residual, 1e-8);
    const StabilityReport report = AssessStability(reduced.map);
    EXPECT_EQ(stable ? StabilityVerdict::kStable : StabilityVerdict::kUnstable, report.verdict)
        << report.message;
    EXPECT_TRUE(VerifyCertificate(reduced.map, report.certificate));
    constexpr double kSize = 1e-4;
    for (int trial = 0; trial < 5; ++trial) {
      Vector w(14);
      for (double& entry : w) entry = normal(generator);
      w = orbit.start_basis * (orbit.start_basis.transpose() * w);
      const double deviation = DeviationAfterFifty(trot, trot.x + kSize * w.normalized());
      if (stable) {
        // A norm contracts by 0.619 a period: what is left is what runs miss, times its condition.
        EXPECT_LE(deviation, 0.3 * kSize) << trial;
      } else {
        EXPECT_GE(deviation, 1e2 * kSize) << trial;
      }
    }
  }
}

TEST(PeriodicOrbit, OfAnElasticBallIsKnown) {
  // Orbits of an elastic ball are a family: the period chooses one, of height g T²/8, seen at the
  // apex and at the impact.
  OrbitProblem problem;
  problem.factory = [](const ParameterValues& values) {
    return MakeModel("bouncing_ball", values);
  };
  problem.parameters = {{"restitution", 1}};
  const auto ball = problem.factory(problem.parameters);
  problem.u = Vector(0);
  problem.section = Section::Apex(*ball, "z");
  problem.x = Vector::Zero(4);
  problem.x(1) = 1.3;
  problem.conditions = {{Kind::kPeriod, 0, 1.0}};
  const OrbitSolution apex = FindOrbit(problem);
  ASSERT_TRUE(apex.ok()) << apex.newton.message;
  EXPECT_NEAR(9.81 / 8, apex.x(1), 1e-11);

  problem.section = Section::Event(*ball, "floor");
  problem.x << 0, 0, 0, 3;
  const OrbitSolution impact = FindOrbit(problem);
  ASSERT_TRUE(impact.ok()) << impact.newton.message;
  EXPECT_NEAR(9.81 / 2, impact.x(3), 1e-11);
  // The gravity that gives apex 1.3 m within a second.
  problem.section = Section::Apex(*ball, "z");
  problem.x << 0, 1.1, 0, 0;
  problem.unknown_parameters = {"gravity"};
  problem.conditions.push_back({Kind::kCoordinate, 1, 1.3});
  const OrbitSolution planet = FindOrbit(problem);
  ASSERT_TRUE(planet.ok()) << planet.newton.message;
  EXPECT_NEAR(8 * 1.3, planet.parameters.at("gravity"), 1e-9);
}

TEST(PeriodicOrbit, SaysWhatIsMissing) {
  const ReferenceCase trot("hopping_trot_stable");
  OrbitProblem problem = TrotProblem(trot);
  problem.unknown_parameters = {"stifness"};
  EXPECT_THROW(FindOrbit(problem), std::invalid_argument);
  problem.unknown_parameters = {};
  problem.conditions = {{Kind::kTouchdown, 2, 0.1}};
  EXPECT_THROW(FindOrbit(problem), std::invalid_argument);
  problem.conditions = {{Kind::kTouchdown, 0, 0.1, -1, 2}};  // a second touchdown
  const OrbitSolution twice = FindOrbit(problem);
  EXPECT_EQ(NewtonStatus::kUndefined, twice.newton.status) << twice.newton.message;
  // A period that no choice of the start alone gives: the least squares are no orbit.
  problem.conditions = {{Kind::kPeriod, 0, 0.9}};
  EXPECT_FALSE(FindOrbit(problem).ok());
  OrbitOptions cancelled;
  cancelled.newton.progress = [](const NewtonIteration&, const Vector&) { return false; };
  problem.x(3) += 0.01;
  EXPECT_EQ(NewtonStatus::kCancelled, FindOrbit(problem, cancelled).newton.status);
}

TEST(PeriodicOrbit, IsNoneWhereTheLastRunWasEnded) {
  const ReferenceCase trot("hopping_trot_stable");
  OrbitProblem problem = TrotProblem(trot);
  problem.x(3) += 0.01;
  OrbitOptions options;
  bool found_one = false;
  options.newton.progress = [&](const NewtonIteration& iteration, const Vector&) {
    found_one = iteration.residual <= options.newton.tolerance;
    return true;
  };
  options.newton.tolerance = 1e-8;
  ASSERT_TRUE(FindOrbit(problem, options).ok());
  BudgetLimits limits;
  limits.look_every = 0;
  limits.cancelled = [&] { return found_one; };  // so that only the run to be shown is ended
  found_one = false;
  const Budget budget(limits);
  const BudgetScope scope(budget);
  const OrbitSolution ended = FindOrbit(problem, options);
  ASSERT_TRUE(found_one);
  EXPECT_EQ(NewtonStatus::kCancelled, ended.newton.status) << ended.newton.message;
  EXPECT_FALSE(ended.orbit.returned());
  EXPECT_LE(ended.newton.iterations.back().residual, options.newton.tolerance);
  EXPECT_EQ(problem.x.size(), ended.x.size());
  ASSERT_TRUE(ended.system);
}

}  // namespace
}  // namespace contact_flow
