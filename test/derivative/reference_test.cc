// SPDX-License-Identifier: BSD-3-Clause
// Every reference case, at the tight and at the default tolerance: events, states,
// modes, derivatives.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace {

using test::Names;
using test::ReferenceCase;

struct Accuracy {
  double tolerance, event_time, state, derivative;
};
constexpr Accuracy kTight = {1e-12, 1e-11, 1e-10, 1e-8};
const Accuracy kDefault = {SimulateOptions().relative_tolerance, 1e-7, 1e-7, 1e-6};

class Reference : public testing::TestWithParam<std::tuple<std::string, Accuracy>> {
 protected:
  Reference() : reference(std::get<0>(GetParam())), accuracy(std::get<1>(GetParam())) {
    options.relative_tolerance = options.absolute_tolerance = accuracy.tolerance;
    derivative_options.tolerance = accuracy.tolerance;
  }
  Trajectory Run() const {
    return Simulate(*reference.system, reference.x, reference.u, reference.duration, options);
  }

  ReferenceCase reference;
  Accuracy accuracy;
  SimulateOptions options;
  BDerivativeOptions derivative_options;
};

TEST_P(Reference, EventsModesAndFinalState) {
  const Trajectory run = Run();
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(static_cast<std::size_t>(reference.event_times.size()), run.transitions.size());
  for (std::size_t k = 0; k < run.transitions.size(); ++k) {
    EXPECT_NEAR(reference.event_times(k), run.transitions[k].t, accuracy.event_time);
  }
  EXPECT_EQ(reference.modes, reference.NamesOf(run.ModeSequence()));
  EXPECT_LE((run.FinalState() - reference.final_state).cwiseAbs().maxCoeff(), accuracy.state);
}

TEST_P(Reference, DirectionalDerivatives) {
  if (reference.derivatives.empty()) return;  // covered by the tests of discontinuity and of events
  const Trajectory run = Run();
  const BDerivative B = DifferentiateOutcome(*reference.system, run, derivative_options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const PiecewiseLinearMap pieces = B.Pieces();
  const double scale = reference.DerivativeScale();
  for (const ReferenceCase::Derivative& d : reference.derivatives) {
    EXPECT_LE((B(d.direction) - d.derivative).cwiseAbs().maxCoeff(), accuracy.derivative * scale)
        << "direction " << d.direction.transpose();
    EXPECT_LE((pieces(d.direction) - d.derivative).cwiseAbs().maxCoeff(),
              accuracy.derivative * scale)
        << "piece of direction " << d.direction.transpose();
  }
}

/// The mode sequence along every perturbation, by simulation at a finite size and predicted to
/// first order. Along directions that tell no contacts apart to first order, events are ~α² apart:
/// they fall into one cluster or split, depending on α and on the reference's own resolution.
TEST_P(Reference, PerturbedModeSequences) {
  if (reference.derivatives.empty()) return;
  const BDerivative B = DifferentiateOutcome(*reference.system, Run(), derivative_options);
  SimulateOptions finely = options;
  finely.relative_tolerance = finely.absolute_tolerance = 1e-12;
  finely.simultaneity_tolerance = 1e-11;
  constexpr double kAlpha = 1e-4;  // α² well above the simultaneity tolerance
  for (const ReferenceCase::Derivative& d : reference.derivatives) {
    const Trajectory run = Simulate(*reference.system, reference.x + kAlpha * d.direction,
                                    reference.u, reference.duration, finely);
    const Names simulated = reference.NamesOf(run.ModeSequence());
    const Names predicted = reference.NamesOf(B.PerturbedModes(d.direction));
    const bool tied = predicted == reference.modes;
    if (tied) {
      EXPECT_TRUE(d.modes == reference.modes || d.modes == simulated)
          << "direction " << d.direction.transpose();
    } else {
      EXPECT_EQ(d.modes, predicted) << "direction " << d.direction.transpose();
      EXPECT_EQ(d.modes, simulated) << "direction " << d.direction.transpose();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllCases, Reference,
    testing::Combine(testing::ValuesIn(test::ReferenceNames()), testing::Values(kTight, kDefault)),
    [](const testing::TestParamInfo<Reference::ParamType>& info) {
      return std::get<0>(info.param) +
             (std::get<1>(info.param).tolerance == kTight.tolerance ? "_tight" : "_default");
    });

std::pair<Trajectory, BDerivative> Differentiate(const ReferenceCase& reference) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  Trajectory run =
      Simulate(*reference.system, reference.x, reference.u, reference.duration, options);
  BDerivative B = DifferentiateOutcome(*reference.system, run);
  return {std::move(run), std::move(B)};
}

TEST(ReferenceStructure, SimultaneousTouchdownHasTwoPiecesThatAgreeOnTheirFace) {
  const ReferenceCase reference("soft_biped_simultaneous");
  const BDerivative B = Differentiate(reference).second;
  const PiecewiseLinearMap map = B.Pieces();
  ASSERT_EQ(2u, map.pieces().size());
  EXPECT_FALSE(B.IsDifferentiable());
  EXPECT_GT(map.Kink(), 0.1);
  const LinearPiece &a = map.pieces()[0], &b = map.pieces()[1];
  ASSERT_EQ(1, a.cone.rows());
  EXPECT_LE((a.cone + b.cone).cwiseAbs().maxCoeff(), 1e-12) << "the cones are two half-spaces";
  // On the common face {n·w = 0} the pieces are equal: A − B = k nᵀ has rank one.
  const Eigen::RowVectorXd n = a.cone.row(0);
  const Matrix difference = a.matrix - b.matrix;
  EXPECT_LE((difference - (difference * n.transpose()) * n).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ((std::vector<std::string>{"left_foot", "right_foot"}), a.omega.at(0));
  EXPECT_EQ((std::vector<std::string>{"right_foot", "left_foot"}), b.omega.at(0));
  EXPECT_EQ((std::vector<std::string>{"{}", "{left_foot}", "{left_foot, right_foot}"}), a.eta);
}

TEST(ReferenceStructure, DecoupledLegsAreC1InBothOrders) {
  const ReferenceCase reference("soft_biped_decoupled");
  const BDerivative B = Differentiate(reference).second;
  EXPECT_TRUE(B.IsDifferentiable());
  EXPECT_EQ(2u, B.Pieces().pieces().size());
  EXPECT_LE(B.Pieces().Kink(), 1e-9);
}

TEST(ReferenceStructure, ActivationWithReleaseHasOnePiece) {
  const ReferenceCase reference("wall_and_floor");
  const BDerivative B = Differentiate(reference).second;
  EXPECT_TRUE(B.IsDifferentiable());
  EXPECT_EQ(1u, B.Pieces().pieces().size());
}

TEST(ReferenceStructure, ElasticClustersBounceAndSeparate) {
  for (const char* name : {"ball_in_corner", "double_pendulum_simultaneous"}) {
    const ReferenceCase reference(name);
    const Trajectory run = Differentiate(reference).first;
    ASSERT_EQ(1u, run.transitions.size());
    const Transition& bounce = run.transitions.front();
    EXPECT_EQ(ConstraintSet({0, 1}), bounce.activated);
    EXPECT_TRUE(bounce.mode_after.Empty());
    EXPECT_GT(bounce.impulse.minCoeff(), 0);
  }
}

TEST(ReferenceStructure, RigidLegsHaveNoDerivativeButTwoOutcomes) {
  const ReferenceCase reference("rigid_biped_simultaneous");
  const auto [run, B] = Differentiate(reference);
  EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("left_foot")) << B.status.message;
  const std::vector<OrderOutcome>& outcomes = B.events.back().outcomes();
  ASSERT_EQ(2u, outcomes.size());
  EXPECT_EQ((std::vector<int>{0, 1}), outcomes[0].order);
  EXPECT_EQ(ContactMode({1}), outcomes[0].mode_after) << "the foot that landed first lets go";
  EXPECT_EQ(ContactMode({0}), outcomes[1].mode_after);
  // Each order's velocity is the limit of the runs on that side of θ(0) = 0: at 1e-6
  // rad, ~1e-6 apart.
  for (const auto& [name, index] :
       {std::pair("rigid_biped_left_first", 0), std::pair("rigid_biped_right_first", 1)}) {
    const ReferenceCase one_sided(name);
    const Trajectory nearby = Differentiate(one_sided).first;
    const Vector landed = nearby.transitions.back().x_plus.tail(3);
    EXPECT_LE((landed - outcomes[index].v_plus).cwiseAbs().maxCoeff(), 1e-5);
  }
}

}  // namespace
}  // namespace contact_flow
