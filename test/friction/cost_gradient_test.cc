// SPDX-License-Identifier: BSD-3-Clause
// The gradient of a cost with friction beside one-sided quotients in quadruple precision.
#include "contact_flow/derivative/cost_gradient.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "contact_flow/flow/simulate.h"
#include "test/friction/friction_case.h"

namespace contact_flow {
namespace {

/// A covector of the final state, without symmetries.
RunCost Covector(const Vector& c) {
  RunCost cost;
  cost.terminal = [c](const Vector& x, Vector* by_state) {
    *by_state = c;
    return c.dot(x);
  };
  return cost;
}

Vector Random(Eigen::Index size) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-1, 1);
  return Vector::NullaryExpr(size, [&] { return uniform(random); });
}

BDerivativeOptions Options(std::vector<int> parameters = {}) {
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  options.variables.parameters = std::move(parameters);
  return options;
}

/// Tolerances as of the forward derivative beside the same quotients, 1e-8, for sums of a few.
TEST(CostGradientWithFriction, AgreesWithReferences) {
  int compared = 0;
  for (const std::string& name : test::FrictionCaseNames()) {
    const test::FrictionCase c(name);
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    const Trajectory run = Simulate(*c.system, c.x, c.u, c.duration, options);
    if (!run.status.ok()) continue;
    const Vector covector = Random(c.system->state_size());
    double scale = 1;
    for (const auto& d : c.derivatives) scale = std::max(scale, d.derivative.cwiseAbs().maxCoeff());
    const std::size_t count = std::min<std::size_t>(3, c.derivatives.size());
    for (std::size_t k = 0; k < count; ++k) {
      const auto& d = c.derivatives[k * c.derivatives.size() / count];
      RunDirection w;
      w.initial = d.direction;
      const CostGradient J = DifferentiateCost(*c.system, run, Covector(covector), Options(), &w);
      ASSERT_TRUE(J.status.ok()) << name << ": " << J.status.message;
      // Tangents by numbers, as these systems have no rotations.
      ASSERT_EQ(c.system->state_size(), d.derivative.size());
      EXPECT_NEAR(covector.dot(d.derivative), J.Along(w), 3e-8 * scale)
          << name << " along " << d.direction.transpose();
      ++compared;
    }
    for (const auto& p : c.by_parameters) {
      const auto index = ParameterIndices(c.system->description(), {p.parameter});
      if (p.parameter[0] == 'g' && p.sign > 0) continue;  // made elastic: another motion
      RunDirection w;
      w.parameters = Vector::Constant(1, p.sign);
      const CostGradient J =
          DifferentiateCost(*c.system, run, Covector(covector), Options(index), &w);
      ASSERT_TRUE(J.status.ok()) << name << ": " << J.status.message;
      const double size = std::max(1.0, p.derivative.cwiseAbs().maxCoeff());
      EXPECT_NEAR(covector.dot(p.derivative), J.Along(w), 3e-8 * size) << name << p.parameter;
      ++compared;
    }
  }
  EXPECT_GT(compared, 30);
}

}  // namespace
}  // namespace contact_flow
