// SPDX-License-Identifier: BSD-3-Clause
// Periodic orbits: the hopping trot through simultaneous touchdown and lift-off from far away, orbits known in
// closed form, order of convergence on and off the kink, and what long simulation says of their stability.
#include "contact_flow/analysis/periodic_orbit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contact_flow/analysis/section.h"
#include "contact_flow/analysis/stability.h"
#include "contact_flow/model/model_library.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using Kind = OrbitCondition::Kind;
using test::ReferenceCase;

const std::vector<std::string> kUnknown = {"axial_stiffness", "axial_damping", "push", "leg_length"};

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
  return {{Kind::kPeriod, 0, 0.8},       {Kind::kCoordinate, 3, 0.8},
          {Kind::kTouchdown, 0, 0.1},    {Kind::kTouchdown, 0, 0, 1},
          {Kind::kLiftOff, 0, 0.7},      {Kind::kLiftOff, 0, 0, 1}};
}

/// Every entry of the state and every unknown parameter 10 % off, in alternating directions; entries that are zero
/// by 10 % of their size elsewhere: 0.1·(0.5 m, 0.1 rad, …).
void MoveOff(double share, OrbitProblem* problem) {
  double sign = 1;
  for (Eigen::Index i = 0; i < problem->x.size(); ++i) {
    const double size = problem->x(i) != 0 ? std::abs(problem->x(i)) : 0.1;
    problem->x(i) += (sign = -sign) * share * size;
  }
  for (const std::string& name : kUnknown) {
    problem->parameters[name] *= 1 + (sign = -sign) * share;
  }
}

TEST(PeriodicOrbit, FindsTheTrotFromTenPercentOff) {
  const ReferenceCase trot("hopping_trot_stable");
  OrbitProblem problem = TrotProblem(trot);
  problem.unknown_parameters = kUnknown;
  problem.conditions = TrotConditions();
  MoveOff(0.1, &problem);
  OrbitOptions options;
  options.newton.progress = [](const NewtonIteration& i, const Vector&) {
    std::printf("%d: |r| = %.2e, step %.3g, piece %d\n", i.iteration, i.residual, i.step, i.piece);
    return true;
  };
  const OrbitSolution found = FindOrbit(problem, options);
  ASSERT_TRUE(found.ok()) << found.newton.message;
  const Trajectory& run = found.orbit.trajectory;
  ASSERT_EQ(2u, run.transitions.size()) << "both feet at once";
  EXPECT_NEAR(0.1, run.transitions[0].t, 1e-11);
  EXPECT_NEAR(0.7, run.transitions[1].t, 1e-11);
  EXPECT_NEAR(0.8, found.orbit.time, 1e-11);
  EXPECT_NEAR(0.8, found.x(3), 1e-11);
  EXPECT_LE(found.system->Separation(found.orbit.x, found.x).cwiseAbs().maxCoeff(), 1e-11);
  // The same as the reference orbit, which another program found; up to where it stands, and moves.
  for (const std::string& name : kUnknown) {
    const double expected = problem.factory({})->description().parameters.size() ? 0 : 0;
    (void)expected;
    double reference = 0;
    for (const Parameter& p : trot.system->description().parameters) {
      if (p.name == name) reference = p.value;
    }
    EXPECT_NEAR(reference, found.parameters.at(name), 1e-8 * (1 + reference)) << name;
  }
}

}  // namespace
}  // namespace contact_flow
