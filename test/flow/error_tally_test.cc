// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/error_tally.h"

#include <gtest/gtest.h>

#include "contact_flow/flow/dop853.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

/// Falls on one coordinate, and keeps its distance on the other.
void Fall(const double* x, double* xdot) {
  xdot[0] = x[1];
  xdot[1] = -9.81;
}

class Tallies : public testing::Test {
 protected:
  Tallies() : ball_(MakeModel("driven_ball")), stepper_(2, Fall) {
    Vector x(2);
    x << 1, -2;
    stepper_.Begin(x);
  }
  /// One more step of so many seconds.
  void Step(double length, ErrorTally* tally) {
    stepper_.TryStep(length, 1e-9, 1e-9);
    stepper_.Finish();
    tally->AddStep(stepper_);
    stepper_.Advance();
  }

  std::shared_ptr<const MechanicalSystem> ball_;
  Dop853 stepper_;
};

/// q⁺ − q⁻ of a late bounce: δq⁺ = −γ δq⁻ on a line. A wrong sign would give 2 + γ.
TEST_F(Tallies, AnImpactTurnsAnErrorByItsRestitution) {
  const double speed = 3;
  for (const double restitution : {0.0, 0.4, 1.0}) {
    ErrorTally tally(ball_->space());
    Step(0.1, &tally);
    const Vector before = tally.error();
    ASSERT_GT(before(0), 0);
    Matrix row(1, 1);
    row << 1;
    Vector rate(1), jump(1);
    rate << -speed;
    jump << (1 + restitution) * speed;
    tally.AddImpact(row, rate, jump);
    EXPECT_NEAR(restitution * before(0), tally.error()(0), 1e-12 * before(0)) << restitution;
    EXPECT_EQ(before(1), tally.error()(1));
  }
}

/// Two bodies hit their floors, one of them at next to no speed: what its delay leaves is the error
/// of its gap, and no more.
TEST(Tally, AContactThatHardlyMovesMakesNoError) {
  const auto biped = MakeModel("rigid_biped");
  const int d = biped->dof();
  ErrorTally tally(biped->space());
  Dop853 stepper(2 * d, [d](const double* x, double* xdot) {
    for (int k = 0; k < d; ++k) {
      xdot[k] = x[d + k];
      xdot[d + k] = -9.81;
    }
  });
  stepper.Begin(Vector::Ones(2 * d));
  stepper.TryStep(0.1, 1e-9, 1e-9);
  stepper.Finish();
  tally.AddStep(stepper);
  const Vector before = tally.error();
  Matrix rows = Matrix::Identity(2, d);
  Vector rates(2), jump = Vector::Zero(d);
  rates << -2, -1e-12;
  jump.head(2) = -rates;
  tally.AddImpact(rows, rates, jump);
  EXPECT_LT(tally.error().maxCoeff(), 3 * before.maxCoeff());
}

/// Two arcs one after the other are one: an error of speed goes on meanwhile.
TEST_F(Tallies, GoOnFromWhereTheyWere) {
  ErrorTally whole(ball_->space()), first(ball_->space()), second(ball_->space());
  Step(0.1, &whole);
  first = whole;
  Step(0.3, &second);
  stepper_.Begin((Vector(2) << 1, -2).finished());
  ErrorTally unused(ball_->space());
  Step(0.1, &unused);
  Step(0.3, &whole);
  first.Continue(0.3, second);
  ASSERT_GT(first.error()(1), 0);
  // Sums of the same terms, in another order.
  EXPECT_NEAR(whole.error()(0), first.error()(0), 1e-12 * whole.error()(0));
  EXPECT_NEAR(whole.error()(1), first.error()(1), 1e-12 * whole.error()(1));
}

}  // namespace
}  // namespace contact_flow
