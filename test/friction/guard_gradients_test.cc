// SPDX-License-Identifier: BSD-3-Clause
#include "src/dynamics/guard_gradients.h"

#include <gtest/gtest.h>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/two_pucks.h"

namespace contact_flow {
namespace {

ContactMode Word(Letter first, Letter second) {
  ContactMode mode;
  mode.Set(0, first);
  mode.Set(1, second);
  return mode;
}

/// Gradients beside central differences of the values: h = 1e-6 leaves 1e-12 f''' + 1e-16/h.
TEST(GuardGradients, AreThoseOfTheValues) {
  const auto system = MakeSystem<test::TwoPucks>({});
  const int d = system->dof();
  ContactDynamics dynamics(*system, Vector::Zero(system->num_inputs()));
  const Guards guards(*system);
  Vector x(2 * d);
  for (int k = 0; k < 2 * d; ++k) x(k) = 0.3 + 0.1 * k - 0.02 * k * k;
  for (const ContactMode& mode :
       {Word(Letter::kSlip, Letter::kSlip), Word(Letter::kStick, Letter::kSlip),
        Word(Letter::kOpen, Letter::kStick), Word(Letter::kOpen, Letter::kOpen)}) {
    const ConstraintSet known = guards.OfForces(mode, {}) | guards.OfSlips(mode) |
                                (ConstraintSet::All(system->num_constraints()) - mode);
    for (int guard : known) {
      const auto at = [&](const Vector& state) {
        return GuardGradients(&dynamics, state, mode, guard).At(guard);
      };
      const Eigen::RowVectorXd gradient = at(x).gradient;
      for (int k = 0; k < 2 * d; ++k) {
        Vector forth = x, back = x;
        forth(k) += 1e-6;
        back(k) -= 1e-6;
        EXPECT_NEAR((at(forth).value - at(back).value) / 2e-6, gradient(k), 1e-8)
            << "guard " << guard << ", coordinate " << k;
      }
    }
  }
}

/// The guard of a slip in space that ends is its speed.
TEST(GuardGradients, SpeedOfASlipInSpace) {
  const auto system = MakeSystem<test::TwoPucks>({});
  const int d = system->dof(), n = system->num_constraints();
  ContactDynamics dynamics(*system, Vector::Zero(system->num_inputs()));
  Vector x = Vector::Zero(2 * d);
  for (int k = 0; k < d; ++k) x(d + k) = 0.3 + 0.1 * k;
  const ContactMode mode = Word(Letter::kSlip, Letter::kSlip);
  const GuardGradients gradients(&dynamics, x, mode, n);
  EXPECT_TRUE(gradients.SlipInSpaceEnds());
  ConstraintTerms terms;
  system->Constraints(x.head(d), x.tail(d), &terms);
  const auto T = terms.jacobian.middleRows<2>(system->friction()[0].row);
  const Eigen::Vector2d slip = T * x.tail(d);
  EXPECT_NEAR(slip.norm(), gradients.At(n).value, 1e-14);
  // d|s|/dv = ŝᵀ T, and no force changes across ŝ any more: its gradient is blind to T⁺ e⊥.
  const Eigen::RowVectorXd expected = slip.transpose() / slip.norm() * T;
  EXPECT_LT((gradients.At(n).gradient.tail(d) - expected).norm(), 1e-14);
  const Vector across = T.transpose() * Eigen::Vector2d(-slip.y(), slip.x());
  for (int guard = 0; guard < n; ++guard) {
    EXPECT_NEAR(0, gradients.At(guard).gradient.tail(d).dot(across), 1e-12);
  }
}

}  // namespace
}  // namespace contact_flow
