// SPDX-License-Identifier: BSD-3-Clause
// Feet of a machine of many limbs that land at once, against perturbed runs.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/model/growing_robots.h"

namespace contact_flow {
namespace {

/// At restitution 0 and 0.4.
class ManyLegs : public testing::TestWithParam<double> {};

TEST_P(ManyLegs, LandAsPerturbedRunsDo) {
  const auto system = MakeRobot(Legs(8, GetParam()));
  const NominalRun& nominal = system->nominal();
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const double duration = 0.26;  // they land at √(2·0.3/9.81) = 0.247 s
  const Trajectory run = Simulate(*system, nominal.x, nominal.u, duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(8, run.transitions.at(0).activated.Size());
  const BDerivative derivative = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(derivative.status.ok()) << derivative.status.message;
  for (int k = 0; k < 4; ++k) {
    Vector w(2 * system->dof());
    for (int i = 0; i < w.size(); ++i) w(i) = std::sin(k + 1.0 + i * i);
    const Vector along = derivative(w);
    const auto error = [&](double h) {
      const Trajectory perturbed =
          Simulate(*system, system->Perturb(nominal.x, h * w), nominal.u, duration, options);
      EXPECT_GT(perturbed.transitions.size(), 7u) << "they land one by one";
      const Vector quotient = system->Separation(perturbed.FinalState(), run.FinalState()) / h;
      return (quotient - along).cwiseAbs().maxCoeff() / along.cwiseAbs().maxCoeff();
    };
    // One-sided: of order h, but for the errors of two runs of tolerance 1e-12 over h = 1e-6.
    const double coarse = error(1e-5), fine = error(1e-6);
    EXPECT_LT(fine, 0.12 * coarse + 1e-5);
    EXPECT_LT(fine, 1e-4);
  }
}

/// The piece and its instants, as matrices, against one direction that is followed without them.
TEST_P(ManyLegs, PiecesAreTheDirectionsThatTheyHold) {
  const auto system = MakeRobot(Legs(8, GetParam()));
  const NominalRun& nominal = system->nominal();
  const Trajectory run = Simulate(*system, nominal.x, nominal.u, 0.26);
  ASSERT_EQ(8, run.transitions.at(0).activated.Size());
  const EventMap event(std::make_shared<ContactDynamics>(*system, nominal.u), run.transitions[0]);
  ASSERT_TRUE(event.status().ok()) << event.status().message;
  for (int k = 0; k < 4; ++k) {
    Vector w(2 * system->dof());
    for (int i = 0; i < w.size(); ++i) w(i) = std::sin(k + 1.0 + i * i);
    const Vector along = event(w);
    const EventPiece piece = event.PieceAlong(w);
    EXPECT_LT((piece.matrix * w - along).cwiseAbs().maxCoeff(),
              1e-11 * along.cwiseAbs().maxCoeff());
    const std::vector<PerturbedEvent> events = event.PerturbedEvents(w);
    ASSERT_EQ(8u, events.size());
    const Vector times = piece.times * w;
    for (int e = 0; e < 8; ++e) EXPECT_NEAR(events[e].time, times(e), 1e-11);
  }
}

INSTANTIATE_TEST_SUITE_P(Restitutions, ManyLegs, testing::Values(0, 0.4));

}  // namespace
}  // namespace contact_flow
