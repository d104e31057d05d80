// SPDX-License-Identifier: BSD-3-Clause
// States without a unique answer, with the numbers that say so in the file.
#include <gtest/gtest.h>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/impact.h"
#include "contact_flow/dynamics/word_selection.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/friction_case.h"

namespace contact_flow {
namespace {

nlohmann::json RefusalCase(const std::string& name) {
  std::ifstream file(std::string(CONTACT_FLOW_TEST_DATA) + "/friction/refusals.json");
  const nlohmann::json all = nlohmann::json::parse(file);
  for (const nlohmann::json& one : all["cases"]) {
    if (one["name"] == name) return one;
  }
  throw std::runtime_error("no refusal " + name);
}

/// Which refusal the contacts in `still` and `slipping` meet at the case's state.
FrictionRefusal::Kind OfForces(const std::string& name, const TouchingContacts& contacts,
                               std::string* sentence = nullptr) {
  const nlohmann::json json = RefusalCase(name);
  const auto system = test::MakeFrictionSystem(json);
  ContactDynamics dynamics(*system, Vector::Zero(0));
  try {
    SelectWord(&dynamics, test::ToState(json["state"]), contacts, 1e-10);
  } catch (const FrictionRefusal& reason) {
    if (sentence != nullptr) *sentence = reason.what();
    return reason.kind;
  }
  throw std::runtime_error(name + " is not refused");
}

FrictionRefusal::Kind OfImpact(const std::string& name) {
  const nlohmann::json json = RefusalCase(name);
  const auto system = test::MakeFrictionSystem(json);
  const Vector x = test::ToState(json["state"]);
  try {
    SolveFrictionalImpact(*system, x.head(system->dof()), x.tail(system->dof()), {0});
  } catch (const FrictionRefusal& reason) {
    return reason.kind;
  }
  throw std::runtime_error(name + " is not refused");
}

TEST(FrictionRefusals, PainleveOfASlidingRod) {
  TouchingContacts sliding;
  sliding.slipping.Set(0, Letter::kBackward);
  EXPECT_EQ(FrictionRefusal::Kind::kInconsistent, OfForces("rod_inconsistent", sliding));
  std::string both;
  EXPECT_EQ(FrictionRefusal::Kind::kIndeterminate, OfForces("rod_indeterminate", sliding, &both));
  EXPECT_NE(std::string::npos, both.find(" rises at ")) << both;
  EXPECT_NE(std::string::npos, both.find(" presses with ")) << both;
}

/// Its forces are not unique; it stays where it is all the same.
TEST(FrictionRefusals, ARodThatLiesIsNone) {
  TouchingContacts still;
  still.still = {0, 1};
  const nlohmann::json json = RefusalCase("rod_lying");
  const auto system = test::MakeFrictionSystem(json);
  const Vector x = test::ToState(json["state"]);
  ContactDynamics dynamics(*system, Vector::Zero(0));
  const ContactMode mode = SelectWord(&dynamics, x, still, 1e-10);
  EXPECT_EQ("ss", mode.Word(2));
  dynamics.Evaluate(x, mode);
  EXPECT_EQ(ConstraintSet({0, 1}), dynamics.shared());
  EXPECT_LT(dynamics.acceleration().norm(), 1e-12);
}

TEST(FrictionRefusals, Impacts) {
  EXPECT_EQ(FrictionRefusal::Kind::kNoImpact, OfImpact("noslip_jam"));
  EXPECT_EQ(FrictionRefusal::Kind::kEnergyGain, OfImpact("newton_energy_gain"));
}

/// The start is refused before anything is computed, with the reason.
TEST(FrictionRefusals, ASimulationSaysWhy) {
  const nlohmann::json json = RefusalCase("rod_inconsistent");
  const auto system = test::MakeFrictionSystem(json);
  try {
    Simulate(*system, test::ToState(json["state"]), Vector::Zero(0), 0.1);
    FAIL();
  } catch (const std::invalid_argument& reason) {
    EXPECT_NE(std::string::npos, std::string(reason.what()).find("no contact forces exist"))
        << reason.what();
    EXPECT_NE(std::string::npos, std::string(reason.what()).find("foot")) << reason.what();
  }
}

/// Flies up to where its foot touches without speed, and would rise alone, or jam if it were
/// pressed: two motions go on. Nothing presses it, so that it flies on, with a warning.
TEST(FrictionRefusals, WhereSeveralMotionsGoOnTheSmallestForcesDo) {
  const nlohmann::json json = RefusalCase("rod_indeterminate");
  const auto system = test::MakeFrictionSystem(json);
  const Vector touch = test::ToState(json["state"]);
  const double g = 9.81, tau = 0.02;
  const auto flight = [&](double t) {  // from touch
    Vector x = touch;
    x.head(3) += t * touch.tail(3);
    x(1) -= 0.5 * g * t * t;
    x(4) -= g * t;
    return x;
  };
  const Trajectory run = Simulate(*system, flight(-tau), Vector::Zero(0), 2 * tau);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_LT((run.FinalState() - flight(tau)).cwiseAbs().maxCoeff(), 1e-8);
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(Outcome::kPainleveIndeterminate, run.transitions[0].obstacle.outcome);
  // Both are told: it rises, or is pressed.
  for (const char* part : {"rises at", "presses with"}) {
    EXPECT_NE(std::string::npos, run.transitions[0].obstacle.message.find(part)) << part;
  }
  EXPECT_EQ(Outcome::kPainleveIndeterminate, DifferentiateOutcome(*system, run).status.outcome);
  EXPECT_THROW(Simulate(*system, touch, Vector::Zero(0), tau), std::invalid_argument);
}

/// An option that friction does not know is no option that is passed over.
TEST(FrictionRefusals, ProjectionAsImpactLaw) {
  const test::FrictionCase c("bouncing_point");
  SimulateOptions options;
  options.impact_law = ImpactLaw::kProjection;
  EXPECT_THROW(Simulate(*c.system, c.x, c.u, c.duration, options), std::invalid_argument);
}

/// A push from outside into the floor: μ p_n is less than what would stop the point, then more.
TEST(FrictionRefusals, APushIntoTheFloorDrags) {
  const test::FrictionCase c("bouncing_point");  // unit mass, μ = 0.3, γ = 0.6
  Vector x(4), push(2);
  x << 0, 0, 2, 0;
  push << 0, -1;  // p_n = (1 + γ) 1 = 1.6, so that s⁺ = 2 − 0.48
  const Vector slips = PushedVelocity(*c.system, x, push, 1e-9);
  EXPECT_NEAR(1.52, slips(0), 1e-12);
  EXPECT_NEAR(0.6, slips(1), 1e-12);
  x(2) = 0.4;
  const Vector sticks = PushedVelocity(*c.system, x, push, 1e-9);
  EXPECT_NEAR(0, sticks(0), 1e-12);
}

/// A puck that is pushed from rest, in space: it slides, and its direction is no piecewise linear
/// function of the state.
TEST(FrictionRefusals, SlipThatBeginsInSpace) {
  const nlohmann::json json = RefusalCase("puck_incipient");
  const auto system = test::MakeFrictionSystem(json);
  SimulateOptions options;
  options.dense = true;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  const Trajectory run =
      Simulate(*system, test::ToState(json["state"]), Vector::Zero(0), 0.1, options);
  ASSERT_EQ(Outcome::kOk, run.status.outcome) << run.status.message;
  EXPECT_NEAR(0.1 * (5 - 0.4 * 9.81), run.FinalState()(3), 1e-8);
  EXPECT_EQ(Outcome::kNotPiecewiseLinear, DifferentiateOutcome(*system, run).status.outcome);
}

/// The run of a case goes on, and has no derivative.
void ExpectNoDerivative(const std::string& name, const std::string& why) {
  const test::FrictionCase drawn(name);
  SimulateOptions tight;
  tight.relative_tolerance = tight.absolute_tolerance = 1e-12;
  const Trajectory run = Simulate(*drawn.system, drawn.x, drawn.u, drawn.duration, tight);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_LE((run.FinalState() - drawn.final_state).cwiseAbs().maxCoeff(), 1e-10);
  const BDerivative map = DifferentiateOutcome(*drawn.system, run);
  EXPECT_EQ(Outcome::kNotDifferentiable, map.status.outcome) << map.status.message;
  EXPECT_NE(std::string::npos, map.status.message.find(why)) << map.status.message;
}

/// Of the tips that land, stop and let go at once the third, which is driven back by the landing
/// once it has let go, has another velocity behind it in another order.
TEST(FrictionRefusals, DrivenBackByAnImpactElsewhere) {
  ExpectNoDerivative("driven_back", "their order decides");
}

/// A tip that lets go as another one lands rests behind the impact, or bounces, having let go just
/// before it.
TEST(FrictionRefusals, DrivenBackIntoFlight) {
  ExpectNoDerivative("driven_back_into_flight", "their order decides");
}

/// What never slips has no force left just before another tip lands: it cannot let go, as it would
/// be pulled back, and perturbed runs end there.
TEST(FrictionRefusals, PerturbedRunsWithoutMotion) {
  ExpectNoDerivative("noslip_without_motion", "which is pulled back");
}

}  // namespace
}  // namespace contact_flow
