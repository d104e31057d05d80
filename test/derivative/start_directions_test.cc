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

/// A block at rest on a slope that is too steep for it begins to slip.
TEST(StartDirections, SaySlipWhereASlipWouldBeReversed) {
  const auto system = MakeModel("block_on_incline", {{"friction", 0.1}});
  Vector x = system->nominal().x;
  x.tail(3) << 0, 0, 1;  // at rest; the clock runs
  const ContactMode mode = InitialMode(*system, x, system->nominal().u);
  ContactDynamics dynamics(*system, system->nominal().u);
  const StartCone cone(&dynamics, x, mode, 0, 1e-9, 1e-6, ImpactLaw::kComplementarity);
  const StartDirections directions(*system, x, mode, cone);
  const double along = dynamics.Field(x, mode)(3) > 0 ? 1 : -1;
  const Vector w = along * Vector::Unit(6, 3);
  EXPECT_TRUE(directions.Judge(w).ok());
  const StartDirections::Judgement against = directions.Judge(-w);
  EXPECT_EQ(Kind::kAgainstSlip, against.kind);
  EXPECT_EQ(0, against.constraint);
  EXPECT_NE(std::string::npos, directions.Sentence(against).find("'floor', which begins to slip"));
  EXPECT_EQ(Kind::kLeavesMode, directions.Judge(-Vector::Unit(6, 1)).kind);
  EXPECT_EQ("leaves the contact mode {floor} of the start",
            directions.Sentence(directions.Judge(Vector::Unit(6, 4))));
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
