// SPDX-License-Identifier: BSD-3-Clause
// Directions in which a run may start, against gaps and their rates at states that were moved.
#include "contact_flow/derivative/start_directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/friction/systems/tips.h"

namespace contact_flow {
namespace {

using Kind = StartDirections::Judgement::Kind;

/// What of J no longer holds, divided by α: gaps, their rates and slips of what never slips, at
/// x ⊞ α w and p + α δp.
double Violation(const std::string& model, const MechanicalSystem& system, const Vector& x,
                 ContactMode mode, const Vector& w, double alpha) {
  ParameterValues values;
  const std::vector<Parameter>& parameters = system.description().parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const double change = w(2 * system.dof() + static_cast<Eigen::Index>(k));
    if (change != 0) values[parameters[k].name] = parameters[k].value + alpha * change;
  }
  const std::unique_ptr<MechanicalSystem> moved = MakeModel(model, values);
  const Vector at = system.Perturb(x, alpha * w.head(2 * system.dof()));
  ConstraintTerms terms;
  moved->Constraints(at.head(system.num_positions()), at.tail(system.dof()), &terms);
  double most = 0;
  for (int i : mode - system.compliant()) {
    const double rate = terms.jacobian.row(i).dot(at.tail(system.dof()));
    most = std::max({most, std::abs(terms.gap(i)), std::abs(rate)});
    if (!system.HasFriction() || system.friction()[i].coefficient != Friction::kNoSlip) continue;
    const Friction& friction = system.friction()[i];
    const Matrix T = terms.jacobian.middleRows(friction.row, friction.dimension);
    most = std::max(most, (T * at.tail(system.dof())).norm());
  }
  return most / alpha;
}

class StartInContact : public testing::TestWithParam<const char*> {};

TEST_P(StartInContact, AdmitsWhatKeepsGapsAndRatesAtZero) {
  const auto system = MakeModel(GetParam());
  const Vector x = system->nominal().x;
  const ContactMode mode = InitialMode(*system, x, system->nominal().u);
  ASSERT_FALSE(mode.Empty());
  Variables variables;
  for (std::size_t k = 0; k < system->description().parameters.size(); ++k) {
    variables.parameters.push_back(static_cast<int>(k));
  }
  const int size = 2 * system->dof() + variables.Size(*system);
  const StartDirections directions(*system, x, mode, StartCone(), variables);
  // Quotients of α = 1e-6 differ from the derivative by α times curvatures of up to 100.
  const double alpha = 1e-6, still = 1e-4;
  int refused = 0;
  for (int k = 0; k < size; ++k) {
    const Vector w = Vector::Unit(size, k);
    SCOPED_TRACE(k);
    const double violation = Violation(GetParam(), *system, x, mode, w, alpha);
    EXPECT_EQ(violation > still, directions.Judge(w).kind == Kind::kLeavesMode) << violation;
    refused += violation > still;
    const Vector kept = directions.Project(w);
    EXPECT_TRUE(directions.Judge(kept).ok());
    EXPECT_LT(Violation(GetParam(), *system, x, mode, kept, alpha), still);
    EXPECT_LT((directions.Projector() * w - kept).norm(), 1e-8);
    EXPECT_LT((ProjectAdmissible(*system, x, mode, w, variables) - kept).norm(), 1e-14);
  }
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Models, StartInContact,
                         testing::Values("puck", "sliding_rod", "wall_and_floor", "rocking_block",
                                         "damped_plate", "block_on_incline", "compass_walker"));

/// Two blocks at rest that are pulled beyond their friction begin to slip.
TEST(StartDirections, SaySlipWhereASlipWouldBeReversed) {
  const auto system = MakeSystem<test::Pair>(
      {{"f0", 5}, {"f1", -10}, {"f2", 6}, {"f3", -10}, {"mu0", 0.1}, {"mu1", 0.1}});
  const Vector x = Vector::Zero(8), u;
  const ContactMode mode = InitialMode(*system, x, u);
  ContactDynamics dynamics(*system, u);
  const StartCone cone(&dynamics, x, mode, 0, 1e-9, 1e-6, ImpactLaw::kComplementarity);
  const StartDirections directions(*system, x, mode, cone);
  EXPECT_TRUE(directions.Judge(Vector::Unit(8, 4)).ok());
  const StartDirections::Judgement against = directions.Judge(-Vector::Unit(8, 4));
  EXPECT_EQ(Kind::kAgainstSlip, against.kind);
  EXPECT_EQ(0, against.constraint);
  EXPECT_NE(std::string::npos, directions.Sentence(against).find("'first', which begins to slip"));
  EXPECT_EQ(Kind::kLeavesMode, directions.Judge(-Vector::Unit(8, 1)).kind);
  EXPECT_EQ("leaves the contact mode {first, second} of the start",
            directions.Sentence(directions.Judge(Vector::Unit(8, 5))));
}

/// A block at rest on a slope too steep for it slips down, by a = g (sin − μ cos). Pushed up at −ε
/// it stops after τ = ε/a₋, a₋ = g (sin + μ cos), and then does the same: x(T) = a (T − τ)²/2.
TEST(StartDirections, FollowTheReversalOfABeginningSlip) {
  const double angle = 0.6, friction = 0.5, g = 9.81, T = 0.4;
  const auto system =
      MakeModel("block_on_incline", {{"friction", friction}, {"incline", angle}, {"gravity", g}});
  Vector x = system->nominal().x;
  x.head(2).setZero();
  x.tail(3) << 0, 0, 1;  // at rest; the clock runs
  const Trajectory run = Simulate(*system, x, system->nominal().u, T);
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.PiecewiseLinear().ok()) << B.PiecewiseLinear().message;
  EXPECT_FALSE(B.IsDifferentiable());
  const double down = g * (std::sin(angle) - friction * std::cos(angle));
  const double up = g * (std::sin(angle) + friction * std::cos(angle));
  const Vector w = Vector::Unit(6, 3);
  EXPECT_NEAR(T, B(w)(0), 1e-9);
  EXPECT_NEAR(1, B(w)(3), 1e-9);
  EXPECT_NEAR(-down * T / up, B(-w)(0), 1e-9);
  EXPECT_NEAR(-down / up, B(-w)(3), 1e-9);
  const PiecewiseLinearMap map = B.Pieces();
  EXPECT_EQ(2u, map.pieces().size());
  for (const double sign : {1.0, -1.0}) {
    EXPECT_LT((map(sign * w) - B(sign * w)).norm(), 1e-12) << sign;
    const Trajectory moved = Simulate(*system, x + 1e-4 * sign * w, system->nominal().u, T);
    const Vector quotient = (moved.FinalState() - run.FinalState()) / 1e-4;
    EXPECT_LT((quotient - B(sign * w)).norm(), 1e-3) << sign;
  }
}

TEST(StartDirections, AdmitAllOfAFlightAndNothingThatIsNotFinite) {
  const auto system = MakeModel("soft_biped");
  const StartDirections flight(*system, system->nominal().x, ContactMode(), StartCone());
  EXPECT_TRUE(flight.KeepsAll());
  EXPECT_TRUE(flight.Judge(Vector::Ones(14)).ok());
  EXPECT_TRUE(flight.Projector().isIdentity(0));
  Vector w = Vector::Ones(14);
  w(3) = std::nan("");
  EXPECT_THROW(flight.Judge(w), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
