// SPDX-License-Identifier: BSD-3-Clause
// Derivatives of runs with friction beside one-sided quotients in quadruple precision.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/piecewise_linear/linear_program.h"
#include "test/friction/friction_case.h"

namespace contact_flow {
namespace {

class FrictionDerivative : public testing::TestWithParam<std::string> {
 protected:
  static Trajectory Run(const test::FrictionCase& c) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    options.dense = true;
    return Simulate(*c.system, c.x, c.u, c.duration, options);
  }
  static double Scale(const test::FrictionCase& c) {
    double scale = 1;
    for (const auto& d : c.derivatives) scale = std::max(scale, d.derivative.cwiseAbs().maxCoeff());
    return scale;
  }
};

TEST_P(FrictionDerivative, AgreesWithQuotients) {
  const test::FrictionCase c(GetParam());
  const Trajectory run = Run(c);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  const BDerivative B = DifferentiateOutcome(*c.system, run, options);
  if (c.derivatives.empty()) {
    const bool together = GetParam() == "order_together";
    EXPECT_EQ(together ? Outcome::kDiscontinuous : Outcome::kOk, B.status.outcome)
        << B.status.message;
    return;
  }
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const auto& d : c.derivatives) {
    const double error = (B(d.direction) - d.derivative).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 1e-8 * Scale(c)) << "along " << d.direction.transpose();
  }
}

TEST_P(FrictionDerivative, ByFrictionAndRestitution) {
  const test::FrictionCase c(GetParam());
  if (c.by_parameters.empty()) return;
  const Trajectory run = Run(c);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  for (const auto& p : c.by_parameters) {
    if (p.parameter[0] == 'g' && p.sign > 0) {
      const int i = p.parameter.back() - '0';
      if (c.system->restitution()(i) == 0) continue;  // made elastic, it bounces: another motion
    }
    BDerivativeOptions options;
    options.tolerance = 1e-11;
    options.variables.parameters = ParameterIndices(c.system->description(), {p.parameter});
    const BDerivative B = DifferentiateOutcome(*c.system, run, options);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    Vector w = Vector::Zero(2 * c.system->dof() + 1);
    w(w.size() - 1) = p.sign;
    const double scale = std::max(1.0, p.derivative.cwiseAbs().maxCoeff());
    EXPECT_LT((B(w) - p.derivative).cwiseAbs().maxCoeff(), 1e-8 * scale)
        << p.parameter << " " << p.sign;
  }
}

/// The whole map says what one direction says.
TEST_P(FrictionDerivative, PiecesAgreeWithQuotients) {
  if (!HaveLinearPrograms()) GTEST_SKIP() << "built without Clp";
  const test::FrictionCase c(GetParam());
  if (c.derivatives.empty()) return;
  const BDerivative B = DifferentiateOutcome(*c.system, Run(c));
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const PiecewiseLinearMap map = B.Pieces();
  for (const auto& d : c.derivatives) {
    const double error = (map(d.direction) - d.derivative).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 1e-7 * Scale(c))
        << map.pieces().size() << " pieces, along " << d.direction.transpose();
  }
}

/// Two slips end at once, and rounding puts 5e-15 s between them: their order does not matter.
TEST_F(FrictionDerivative, StopsThatAreNotToldApartCommute) {
  const test::FrictionCase c("double_stop_by_rounding");
  const Trajectory run = Run(c);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(*c.system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  for (const auto& d : c.derivatives) {
    EXPECT_LT((B(d.direction) - d.derivative).cwiseAbs().maxCoeff(), 1e-8 * Scale(c));
  }
}

INSTANTIATE_TEST_SUITE_P(Cases, FrictionDerivative, testing::ValuesIn(test::FrictionCaseNames()),
                         [](const auto& info) { return info.param; });

}  // namespace
}  // namespace contact_flow
