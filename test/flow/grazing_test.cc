// SPDX-License-Identifier: BSD-3-Clause
// Touches with vanishing speed, and releases with dλ/dt = 0, go on.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::AtTolerance;

/// y = 1 + cos(t − 1) touches the floor at π + 1 and goes on.
TEST(Grazing, GoesOffAgain) {
  const auto system = test::Make<test::Oscillator>();
  Vector x(2);
  x << 1 + std::cos(1.0), std::sin(1.0);
  const Trajectory run = Simulate(system, x, Vector(0), 10, AtTolerance(1e-10));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(ConstraintSet({0}), run.transitions[0].grazed);
  EXPECT_EQ(ContactMode(), run.transitions[0].mode_after);
  EXPECT_EQ(0, run.margins.approach_speed);
  // It is touched at a speed of up to √(2 · 10 floors): as much is uncertain.
  EXPECT_NEAR(1 + std::cos(9.0), run.FinalState()(0), 1e-4);
  ASSERT_EQ(1, run.num_warnings);
  EXPECT_EQ(Outcome::kGrazing, run.warnings[0].code);
  EXPECT_NE(std::string::npos, run.warnings[0].message.find("'floor'"));
  const BDerivative B = DifferentiateOutcome(system, run);
  EXPECT_EQ(Outcome::kGrazing, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("'floor'")) << B.status.message;
  EXPECT_NE(std::string::npos, B.status.message.find("4.14159")) << B.status.message;
}

/// Gaps below 1e-6 m are not resolved, for 3e-3 s: also where several steps begin and end there.
TEST(Grazing, IsSeenByShortSteps) {
  const auto system = test::Make<test::Oscillator>();
  Vector x(2);
  x << 1 + std::cos(1.0), std::sin(1.0);
  for (const double step : {1e-2, 3e-3, 1e-3, 3e-4}) {
    SimulateOptions options = AtTolerance(1e-6);
    options.max_step = step;
    const Trajectory run = Simulate(system, x, Vector(0), 6, options);
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    ASSERT_EQ(1u, run.transitions.size()) << step;
    EXPECT_EQ(ConstraintSet({0}), run.transitions[0].grazed) << step;
    EXPECT_EQ(Outcome::kGrazing, DifferentiateOutcome(system, run).status.outcome) << step;
  }
}

TEST(Grazing, OnlineRunsGoOnToo) {
  const auto system = std::make_shared<ModelSystem<test::Oscillator>>(ParameterValues{});
  Vector x(2);
  x << 1 + std::cos(1.0), std::sin(1.0);
  OnlineFlow flow(system, 0, x, Vector(0), AtTolerance(1e-10));
  int transitions = 0;
  while (flow.now() < 10 && flow.status().ok()) transitions += flow.AdvanceTo(10);
  EXPECT_TRUE(flow.status().ok()) << flow.status().message;
  EXPECT_EQ(1, transitions);
  EXPECT_EQ(1, flow.num_warnings());
}

/// y = (1 − t)³ comes to the floor with ẏ = ÿ = 0 and is pressed on it from then on, by 6 (t − 1).
struct SetDown : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "set_down";
  static constexpr std::array<const char*, 2> kCoordinates = {"y", "clock"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = 6.0 * (1.0 - q(1));
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

TEST(Grazing, AFootThatIsSetDownStands) {
  const auto system = test::Make<SetDown>();
  Vector x(4);
  x << 1, 0, -3, 1;
  const Trajectory run = Simulate(system, x, Vector(0), 3);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_GE(run.transitions.size(), 1u);
  // The search for zeros does not resolve gaps below 1e-9 m: (1 − t)³ is below from 1e-3 s before.
  EXPECT_NEAR(1, run.transitions[0].t, 2e-3);
  EXPECT_EQ(ContactMode({0}), run.arcs.back().mode);
  // Let off once too often, it may go down by 20 absolute tolerances before it is held.
  EXPECT_NEAR(0, run.FinalState()(0), 2e-8);
  EXPECT_NEAR(0, run.FinalState()(2), 1e-12);
}

/// λ = 1 + cos w touches zero, or 10⁻¹² beside it, and grows again.
TEST(Grazing, AForceThatTouchesZeroHolds) {
  for (const double load : {1.0, 1 - 1e-12, 1 + 1e-12, 1 - 1e-10}) {
    const auto system = test::Make<test::PressedBlock>({{"load", load}});
    for (const double phase : {-0.5, 0.3, 2.0, M_PI}) {
      Vector x(4);
      x << 0, phase, 0, 1;
      const Trajectory run = Simulate(system, x, Vector(0), 12);
      ASSERT_TRUE(run.status.ok()) << load << ": " << run.status.message;
      EXPECT_NEAR(0, run.FinalState()(0), 1e-8);
    }
  }
}

/// States where legs have no direction: neither crash nor numbers.
TEST(InitialModes, StatesWithoutForcesAreRefused) {
  for (const std::string& model : {"rigid_biped", "soft_biped", "jointed_biped", "hopping_trot"}) {
    const auto system = MakeModel(model);
    try {
      const Vector x = Vector::Zero(system->state_size());
      const Trajectory run = Simulate(*system, x, Vector::Zero(system->num_inputs()), 0.1);
      EXPECT_TRUE(!run.status.ok() || run.FinalState().allFinite()) << model;
    } catch (const std::invalid_argument& refusal) {
      EXPECT_NE(std::string(), refusal.what());
    }
  }
}

}  // namespace
}  // namespace contact_flow
