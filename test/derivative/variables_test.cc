// SPDX-License-Identifier: BSD-3-Clause
// Derivatives by inputs and parameters, and on configuration spaces, bilateral constraints and
// compliant contacts, against one-sided quotients of perturbed runs.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

struct Varied {
  std::string name, model;
  ParameterValues parameters;
  double duration;  // 0: the nominal one
  ImpactLaw law = ImpactLaw::kComplementarity;
};

/// Each case under both laws.
std::vector<Varied> UnderBothLaws(std::vector<Varied> cases) {
  const std::size_t count = cases.size();
  for (std::size_t k = 0; k < count; ++k) {
    cases.push_back(cases[k]);
    cases.back().name += "_projection";
    cases.back().law = ImpactLaw::kProjection;
  }
  return cases;
}

class VariablesTest : public testing::TestWithParam<Varied> {
 protected:
  VariablesTest()
      : system(MakeModel(GetParam().model, GetParam().parameters)),
        duration(GetParam().duration > 0 ? GetParam().duration : system->nominal().duration) {
    exact.relative_tolerance = exact.absolute_tolerance = 1e-12;
    exact.impact_law = GetParam().law;
    run = Simulate(*system, system->nominal().x, system->nominal().u, duration, exact);
    BDerivativeOptions options;
    options.variables.inputs = true;
    for (std::size_t k = 0; k < system->description().parameters.size(); ++k) {
      options.variables.parameters.push_back(static_cast<int>(k));
    }
    options.tolerance = 1e-11;
    B = DifferentiateOutcome(*system, run, options);
  }

  std::unique_ptr<MechanicalSystem> system;
  const double duration;
  SimulateOptions exact;
  Trajectory run;
  BDerivative B;
};

/// (φ(αw) − φ)/α − B(w) = O(α): at α = 1e-5 the error is 1e-5 times second derivatives (≤ 1e3
/// here), and it falls with slope 1 unless it is at the level of rounding.
TEST_P(VariablesTest, QuotientsConverge) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Variables& variables = B.options.variables;
  const SystemFactory factory = [&](const ParameterValues& values) {
    return MakeModel(GetParam().model, values);
  };
  const int tangents = 2 * system->dof(), size = tangents + variables.Size(*system);
  int compared = 0;
  for (int k = 0; k < size; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Vector w = sign * Vector::Unit(size, k);
      const Vector admitted =
          ProjectAdmissible(*system, system->nominal().x, B.initial_mode, w, variables);
      if ((admitted - w).norm() > 1e-9) continue;
      QuotientReport report;
      try {
        report = CompareWithQuotients(*system, factory, variables, system->nominal().x,
                                      InputSchedule::Constant(system->nominal().u), duration, w,
                                      B(w), {1e-4, 1e-5}, exact);
      } catch (const std::invalid_argument&) {
        continue;  // a parameter beyond its range
      }
      if (!report.samples[1].status.ok()) continue;
      ++compared;
      const double scale = 1 + B(w).cwiseAbs().maxCoeff();
      EXPECT_LE(report.samples[1].error, 1e-2 * scale) << "direction " << k << " sign " << sign;
      if (!std::isnan(report.slope)) {
        EXPECT_NEAR(report.slope, 1, 0.15)
            << "direction " << k << " sign " << sign << ", errors " << report.samples[0].error
            << " and " << report.samples[1].error;
      }
    }
  }
  EXPECT_GE(compared, 4);
}

TEST_P(VariablesTest, PiecesAgreeWithDirections) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const PiecewiseLinearMap map = B.Pieces();
  EXPECT_EQ(2 * system->dof(), map.rows());
  for (int k = 0; k < map.cols(); ++k) {
    const Vector w =
        Vector::Unit(map.cols(), k) - 0.3 * Vector::Unit(map.cols(), (k + 1) % map.cols());
    EXPECT_LE((map(w) - B(w)).cwiseAbs().maxCoeff(), 1e-9 * (1 + B(w).cwiseAbs().maxCoeff()));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Models, VariablesTest,
    testing::ValuesIn(UnderBothLaws(
        {Varied{"soft_biped", "soft_biped", {}, 0},
         Varied{"double_pendulum", "double_pendulum", {}, 0},
         Varied{"legged_table", "legged_table", {}, 0}, Varied{"falling_box", "falling_box", {}, 0},
         Varied{"plastic_box", "falling_box", {{"restitution", 0}}, 0.485},
         Varied{"bouncing_ball", "bouncing_ball", {}, 0},
         Varied{"wall_and_floor", "wall_and_floor", {}, 0}, Varied{"chair", "chair", {}, 0}})),
    [](const testing::TestParamInfo<Varied>& info) { return info.param.name; });

}  // namespace
}  // namespace contact_flow
