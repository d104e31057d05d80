// SPDX-License-Identifier: BSD-3-Clause
// The laws every trajectory obeys, for each model of the library from random states.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/model/model_names.h"

namespace contact_flow {
namespace {

constexpr double kTolerance = 1e-9;
/// What the integrator may leave of a constraint after seconds of motion: global error
/// ~1e3 tolerances.
constexpr double kPenetration = 1e-6;
constexpr int kRuns = 60;

class TrajectoryLaws : public testing::TestWithParam<std::string> {
 protected:
  TrajectoryLaws()
      : system(MakeModel(GetParam())),
        u(system->nominal().u),
        d(system->dof()),
        nq(system->num_positions()) {
    options.relative_tolerance = options.absolute_tolerance = kTolerance;
    options.max_events = 200;
    options.max_seconds = 5;
  }
  /// A state around the nominal one that the simulator accepts.
  Vector AcceptableState() {
    std::normal_distribution<double> normal;
    for (;;) {
      Vector w(2 * d);
      for (int i = 0; i < 2 * d; ++i) w(i) = (i < d ? 0.1 : 0.7) * normal(generator);
      Vector x = system->Perturb(system->nominal().x, w);
      if (HasStateManifold(*system)) ProjectState(*system, &x);
      try {
        InitialMode(*system, x, u, options);
        return x;
      } catch (const std::invalid_argument&) {  // penetrates: draw again
      }
    }
  }

  std::unique_ptr<MechanicalSystem> system;
  const Vector u;
  const int d, nq;
  SimulateOptions options;
  std::mt19937 generator{17};
};

TEST_P(TrajectoryLaws, HoldFromRandomStates) {
  ContactDynamics dynamics(*system, u);
  const double horizon = std::min(2.0, 1.4 * system->nominal().duration);
  int complete = 0;
  for (int k = 0; k < kRuns; ++k) {
    SCOPED_TRACE("run " + std::to_string(k));
    const Vector x = AcceptableState();
    const Trajectory run = Simulate(*system, x, u, horizon, options);
    complete += run.status.ok();
    EXPECT_EQ(run.status.ok(), run.status.message.empty());
    ASSERT_EQ(run.arcs.size(), run.transitions.size() + 1);
    EXPECT_LE((x - run.arcs.front().x_begin).norm(), HasStateManifold(*system) ? 1e-13 : 0);
    if (run.status.ok()) {
      EXPECT_EQ(horizon, run.t_end());
    }
    for (std::size_t e = 0; e < run.transitions.size(); ++e) {
      const Transition& event = run.transitions[e];
      EXPECT_EQ(event.t, run.arcs[e].t_end);
      EXPECT_EQ(event.t, run.arcs[e + 1].t_begin);
      EXPECT_EQ(event.x_minus, run.arcs[e].x_end);
      EXPECT_EQ(event.x_plus, run.arcs[e + 1].x_begin);
      EXPECT_EQ(event.mode_after, run.arcs[e + 1].mode);
      EXPECT_EQ(event.x_minus.head(nq), event.x_plus.head(nq)) << "positions do not jump";
      EXPECT_GE(event.impulse.head(system->num_constraints()).minCoeff(), 0);
      EXPECT_FALSE((event.activated | event.vanishing | event.switched | event.grazed).Empty())
          << "an event has a reason";
    }
    for (const Arc& arc : run.arcs) {
      EXPECT_LE(arc.t_begin, arc.t_end);
      for (int s = 1; s < 10 && arc.t_end > arc.t_begin; ++s) {
        const double t = arc.t_begin + (arc.t_end - arc.t_begin) * s / 10;
        const Vector at = run.State(t);
        ASSERT_TRUE(at.allFinite());
        ConstraintTerms terms;
        system->Constraints(at.head(nq), at.tail(d), &terms);
        dynamics.Evaluate(at, arc.mode);
        const double force_scale = 1 + dynamics.force().cwiseAbs().maxCoeff();
        for (int i = 0; i < system->num_constraints(); ++i) {
          if (system->compliant().Contains(i)) {
            const double inside = arc.mode.Contains(i) ? -terms.gap(i) : terms.gap(i);
            EXPECT_GE(inside, -kPenetration) << "compliant constraint " << i << " at t = " << t;
            continue;
          }
          EXPECT_GE(terms.gap(i), -kPenetration) << "constraint " << i << " at t = " << t;
          if (!arc.mode.Contains(i)) continue;
          EXPECT_LE(std::abs(terms.gap(i)), kPenetration) << "contact " << i << " at t = " << t;
          EXPECT_GE(dynamics.force()(i), -kPenetration * force_scale) << "pulls at t = " << t;
        }
      }
    }
  }
  EXPECT_GT(complete, 0) << "no run reached its horizon";
}

TEST_P(TrajectoryLaws, RunsRepeatToTheBit) {
  for (int k = 0; k < 5; ++k) {
    const Vector x = AcceptableState();
    const Trajectory once = Simulate(*system, x, u, 2, options);
    const Trajectory again = Simulate(*system, x, u, 2, options);
    EXPECT_EQ(once.FinalState(), again.FinalState());
    EXPECT_EQ(once.transitions.size(), again.transitions.size());
    SimulateOptions lean = options;
    lean.dense = false;
    EXPECT_EQ(once.FinalState(), Simulate(*system, x, u, 2, lean).FinalState())
        << "keeping the dense output does not change the run";
  }
}

INSTANTIATE_TEST_SUITE_P(AllModels, TrajectoryLaws, testing::ValuesIn(test::FrictionlessModels()),
                         [](const testing::TestParamInfo<std::string>& info) {
                           return info.param;
                         });

}  // namespace
}  // namespace contact_flow
