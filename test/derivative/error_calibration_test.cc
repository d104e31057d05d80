// SPDX-License-Identifier: BSD-3-Clause
// The errors that a derivative estimates of its run and of itself, against the true ones: of the
// same run at tolerances ten thousand times as tight. Models at random states, by every law and
// method and by all variables, simultaneous touchdowns, and gusts on a small part of the way.
#include "test/derivative/error_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"
#include "test/derivative/localized_forces.h"
#include "test/model/hard_quadruped.h"

namespace contact_flow {
namespace {

using test::Calibration;
using test::CalibrationCase;

constexpr double kTolerances[] = {1e-6, 1e-8, 1e-10};

/// All models from random states near their nominal ones, `spread` away.
void AddModels(int seeds, double spread, const std::function<void(CalibrationCase*)>& change,
               Calibration* calibration) {
  for (const std::string& name : ModelNames()) {
    const auto system = MakeModel(name);
    const NominalRun& nominal = system->nominal();
    const ContactMode mode = InitialMode(*system, nominal.x, nominal.u);
    for (int seed = 0; seed < seeds; ++seed) {
      std::mt19937 random(seed * 101 + 7);
      std::normal_distribution<double> normal;
      Vector w(2 * system->dof());
      for (double& entry : w) entry = spread * normal(random);
      CalibrationCase c;
      c.system = system.get();
      c.x = system->Perturb(nominal.x, ProjectAdmissible(*system, nominal.x, mode, w));
      c.input = InputSchedule::Constant(nominal.u);
      c.duration = nominal.duration * (0.5 + static_cast<double>(random() % 1000) / 1000);
      change(&c);
      for (double tolerance : kTolerances) calibration->Add(c, tolerance, seed);
    }
  }
}

/// One to three gusts of a hundredth to a third of a metre, in one to three coordinates.
void AddLocalizedForces(int seeds, Calibration* calibration) {
  for (int seed = 0; seed < seeds; ++seed) {
    std::mt19937 random(seed * 7919 + 1);
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
    };
    const int d = 1 + static_cast<int>(random() % 3);
    Matrix L(d, 2 * d);
    for (int i = 0; i < d; ++i) {
      for (int j = 0; j < 2 * d; ++j) L(i, j) = uniform(-1, 1) * (j < d ? 3 : 0.5);
    }
    CalibrationCase c;
    c.x = Vector(2 * d);
    for (double& entry : c.x) entry = uniform(-1, 1);
    c.input = InputSchedule::Constant(Vector(0));
    c.duration = uniform(0.3, 0.8);
    c.options.max_step = c.reference.max_step = c.duration / 50;
    std::vector<test::LocalizedForces::Term> gusts(1 + random() % 3);
    for (auto& gust : gusts) {
      gust.amplitude = uniform(1, 30);
      gust.width = std::pow(10, uniform(-2, -0.5));
      gust.push = Vector(d);
      for (double& entry : gust.push) entry = uniform(-1, 1);
      gust.along = Matrix::Zero(1, 2 * d);
      gust.along(0, static_cast<int>(random() % static_cast<unsigned>(d))) = 1;
      gust.centre = Vector::Constant(1, uniform(-1, 1));
    }
    const test::LocalizedForces system(ConfigurationSpace(d), -9.81 * Vector::Unit(d, 0), L, gusts);
    c.system = &system;
    for (double tolerance : kTolerances) calibration->Add(c, tolerance, seed);
  }
}

void ByAllVariables(CalibrationCase* c) {
  c->variables.inputs = true;
  c->variables.parameters.resize(c->system->description().parameters.size());
  std::iota(c->variables.parameters.begin(), c->variables.parameters.end(), 0);
}

TEST(ErrorCalibration, OfModels) {
  Calibration c("models");
  AddModels(
      6, 0.05, [](CalibrationCase*) {}, &c);
  c.Expect(400);
}

TEST(ErrorCalibration, OfSimultaneousTouchdowns) {
  Calibration c("nominal runs");
  AddModels(
      3, 0, [](CalibrationCase*) {}, &c);
  c.Expect(200);
}

TEST(ErrorCalibration, ByInputsAndParameters) {
  Calibration c("variables");
  AddModels(3, 0.05, ByAllVariables, &c);
  c.Expect(200);
}

TEST(ErrorCalibration, ByProjection) {
  Calibration c("projection");
  AddModels(
      3, 0.05,
      [](CalibrationCase* run) {
        run->options.impact_law = run->reference.impact_law = ImpactLaw::kProjection;
      },
      &c);
  c.Expect(200);
}

TEST(ErrorCalibration, OfTheImplicitMethod) {
  Calibration c("implicit");
  AddModels(
      3, 0.05,
      [](CalibrationCase* run) {
        run->options.method = IntegrationMethod::kImplicit;
        run->reference.method = IntegrationMethod::kExplicit;
      },
      &c);
  c.Expect(200);
}

/// Tangents whose fast parts have decayed, in flight and behind touchdowns. Estimates are large:
/// they keep what every step adds, of which most has decayed at the end.
TEST(ErrorCalibration, OfHardServos) {
  Calibration c("hard servos");
  for (const double gain : {10, 100}) {
    const auto robot = HardQuadruped(gain);
    for (int seed = 0; seed < 8; ++seed) {
      std::mt19937 random(seed * 31 + 5);
      std::normal_distribution<double> normal;
      Vector w = Vector::Zero(36);
      for (int j = 3; j < 36; ++j) w(j) = 0.05 * normal(random);
      CalibrationCase run;
      run.system = robot.get();
      run.x = robot->Perturb(robot->nominal().x, w);
      run.input = InputSchedule::Constant(robot->nominal().u);
      run.duration = 0.1 + 0.02 * seed;
      run.options.method = run.reference.method = IntegrationMethod::kImplicit;
      for (double tolerance : kTolerances) c.Add(run, tolerance, seed);
    }
  }
  c.ExpectEnough(12);
}

TEST(ErrorCalibration, OfGusts) {
  Calibration c("gusts");
  AddLocalizedForces(60, &c);
  c.Expect(200);
}

}  // namespace
}  // namespace contact_flow
