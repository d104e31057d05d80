// SPDX-License-Identifier: BSD-3-Clause
// The derivatives that we compute ourselves are continuous maps: cones cover, pieces agree.
#include <gtest/gtest.h>

#include <cstdio>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "contact_flow/piecewise_linear/map_consistency.h"
#include "test/model/robots.h"

namespace contact_flow {
namespace {

void ExpectLawful(const std::string& name, const MechanicalSystem& system) {
  const NominalRun& nominal = system.nominal();
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  const Trajectory run = Simulate(system, nominal.x, nominal.u, nominal.duration, options);
  if (!run.status.ok()) return;
  const BDerivative B = DifferentiateOutcome(system, run);
  if (!B.status.ok()) return;
  if (!B.start.Empty()) return;  // it touches: directions out of the domain are in no cone
  const PiecewiseLinearMap map = B.Pieces();
  const MapConsistency found = CheckConsistency(map);
  std::printf("%s: %zu pieces in %d dimensions, %ld linear programs: %s\n", name.c_str(),
              map.pieces().size(), map.cols(), found.linear_programs, MapDefectName(found.defect));
  EXPECT_TRUE(found.ok()) << name << ": " << found.message;
}

TEST(MapLaw, DerivativesOfAllModelsAreContinuous) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  for (const std::string& name : ModelNames()) ExpectLawful(name, *MakeModel(name));
  for (const std::string& name : ShippedRobots()) ExpectLawful(name, *LoadRobot(RobotFile(name)));
}

}  // namespace
}  // namespace contact_flow
