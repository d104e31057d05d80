// SPDX-License-Identifier: BSD-3-Clause
// Estimated errors of runs with friction, and in other units, beside the true ones.
#include "test/derivative/error_calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "contact_flow/model/model_library.h"
#include "test/adversary/rescaled_system.h"
#include "test/friction/systems/drawn_contacts.h"

namespace contact_flow {
namespace {

using test::Calibration;
using test::CalibrationCase;

constexpr double kTolerances[] = {1e-6, 1e-8, 1e-10};

void AddDrawn(int seeds, int rows, Calibration* calibration) {
  for (int seed = 0; seed < seeds; ++seed) {
    const test::DrawnContacts drawn = test::DrawContacts(seed, rows);
    CalibrationCase c;
    c.system = drawn.system.get();
    c.x = drawn.x;
    c.input = InputSchedule::Constant(Vector::Zero(drawn.system->num_inputs()));
    c.duration = drawn.duration;
    c.options = c.reference = test::TightOptions(drawn.size);
    c.unit = drawn.size;
    const double size = drawn.size;
    c.back = [size](const Vector& tangent) { return Vector(tangent / size); };
    for (double tolerance : kTolerances) calibration->Add(c, tolerance, seed);
  }
}

TEST(FrictionErrors, InThePlaneAreCalibrated) {
  Calibration c("friction in the plane");
  AddDrawn(50, 1, &c);
  c.Expect(100);
}

TEST(FrictionErrors, InSpaceAreCalibrated) {
  Calibration c("friction in space");
  AddDrawn(8, 2, &c);
  c.Expect(15);
}

/// Lengths of 1e-4 to 1e4, masses and times of 1e-4 to 1e4.
TEST(ErrorsInOtherUnits, AreCalibrated) {
  Calibration calibration("other units");
  for (const char* name : {"soft_biped", "rigid_biped", "double_pendulum", "ball_in_corner",
                           "legged_table", "wall_and_floor", "two_discs"}) {
    const auto system = MakeModel(name);
    const NominalRun& nominal = system->nominal();
    const int d = system->dof(), n = system->num_constraints();
    for (int seed = 0; seed < 6; ++seed) {
      test::Dice dice(static_cast<unsigned>(seed) * 17 + 3);
      adversary::Units units = adversary::Units::Same(d, n);
      const double length = std::exp2(std::round(dice.Uniform(-13, 13)));
      units.mass = std::exp2(std::round(dice.Uniform(-13, 13)));
      units.time = std::exp2(std::round(dice.Uniform(-13, 13)));
      units.length *= length;
      units.gap *= length;
      const adversary::RescaledSystem rescaled(*system, units);
      Vector w(2 * d);
      for (double& entry : w) entry = 0.05 * dice.Normal();
      const ContactMode mode = InitialMode(*system, nominal.x, nominal.u);
      CalibrationCase c;
      c.system = &rescaled;
      c.x = units.State(system->Perturb(nominal.x, ProjectAdmissible(*system, nominal.x, mode, w)));
      c.input = InputSchedule::Constant(nominal.u);
      c.duration = units.time * nominal.duration;
      c.options = units.Scale(SimulateOptions());
      c.reference = c.options;
      c.unit = length * std::min(1.0, 1 / units.time);
      c.back = [&units](const Vector& tangent) { return units.Back(tangent); };
      for (double tolerance : kTolerances) calibration.Add(c, tolerance, seed);
    }
  }
  calibration.Expect(100);
}

}  // namespace
}  // namespace contact_flow
