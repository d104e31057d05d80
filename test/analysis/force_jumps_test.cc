// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/analysis/force_jumps.h"

#include <gtest/gtest.h>

#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// The report of the first transition of a model's nominal run.
ForceJumpReport At(const MechanicalSystem& system) {
  const NominalRun& nominal = system.nominal();
  const Trajectory run = Simulate(system, nominal.x, nominal.u, nominal.duration);
  return AssessForceJumps(system, nominal.u, run.transitions.front());
}
ForceJumpReport At(const std::string& name, const ParameterValues& parameters = {}) {
  return At(*MakeModel(name, parameters));
}

/// The table's force at S = ∅, {first}, {second}, both, against the closed form of damped_plate.h:
/// weight + Σ p_k, p_k = drive/ratio_k before and −γ·drive/ratio_k after the impact; here p = 1.6
/// and ±2, γ = 0.5. Forces of ~1 N, at speeds exact to 1e-9.
void ExpectTable(const ForceJumpReport& report, double none, double first, double second,
                 double both) {
  ASSERT_TRUE(report.computed);
  ASSERT_FALSE(report.contacts.empty());
  const ForceJump& table = report.contacts.front();
  ASSERT_EQ(0, table.constraint);
  ASSERT_EQ(4u, table.stages.size());
  EXPECT_EQ(ConstraintSet(), table.stages[0].activated);
  EXPECT_EQ(ConstraintSet({1}), table.stages[1].activated);
  EXPECT_EQ(ConstraintSet({2}), table.stages[2].activated);
  EXPECT_EQ(ConstraintSet({1, 2}), table.stages[3].activated);
  EXPECT_NEAR(none, table.stages[0].force, 1e-7);
  EXPECT_NEAR(first, table.stages[1].force, 1e-7);
  EXPECT_NEAR(second, table.stages[2].force, 1e-7);
  EXPECT_NEAR(both, table.stages[3].force, 1e-7);
}

TEST(ForceJumps, AContactThatKeepsThroughBothImpacts) {
  const ForceJumpReport report = At("damped_plate", {{"weight", 4}});
  ExpectTable(report, 3.6, 1.2, 6.6, 4.2);
  ASSERT_EQ(1u, report.contacts.size()) << "bouncing carts do not rest";
  EXPECT_EQ(ForceFate::kKeeps, report.contacts[0].fate);
  EXPECT_TRUE(report.smooth());
}

TEST(ForceJumps, AContactThatLetsGoBetweenAndIsRegained) {
  const ForceJumpReport report = At("damped_plate");
  ExpectTable(report, 0.6, -1.8, 3.6, 1.2);
  EXPECT_EQ(ForceFate::kRegained, report.contacts[0].fate);
  EXPECT_FALSE(report.smooth());
}

TEST(ForceJumps, AContactThatIsReleased) {
  const ForceJumpReport late = At("damped_plate", {{"weight", 0}, {"ratio_second", 0.6}});
  ExpectTable(late, 3.6, 1.2, 0.6, -1.8);
  EXPECT_EQ(ForceFate::kReleased, late.contacts[0].fate);
  EXPECT_TRUE(late.smooth());
  const ForceJumpReport early = At("damped_plate", {{"weight", -0.8}, {"ratio_second", 0.6}});
  ExpectTable(early, 2.8, 0.4, -0.2, -2.6);
  EXPECT_EQ(ForceFate::kReleased, early.contacts[0].fate);
}

TEST(ForceJumps, AForceThatVanishesAtAStageIsSaid) {
  const ForceJumpReport last = At("damped_plate", {{"weight", 1.8}, {"ratio_second", 0.6}});
  ExpectTable(last, 5.4, 3, 2.4, 0);
  EXPECT_EQ(ForceFate::kNearZero, last.contacts[0].fate);
  const ForceJumpReport between = At("damped_plate", {{"weight", 2.8}});
  ExpectTable(between, 2.4, 0, 5.4, 3);
  EXPECT_EQ(ForceFate::kNearZero, between.contacts[0].fate);
  EXPECT_FALSE(between.smooth());
  // On either side of the border it is decided.
  EXPECT_EQ(ForceFate::kKeeps, At("damped_plate", {{"weight", 2.8002}}).contacts[0].fate);
  EXPECT_EQ(ForceFate::kRegained, At("damped_plate", {{"weight", 2.7998}}).contacts[0].fate);
}

TEST(ForceJumps, PlasticContactsOfTheClusterAreFollowedOnceTheyAreHit) {
  const ForceJumpReport report = At("damped_plate", {{"restitution", 0}});
  ExpectTable(report, 0.6, -1, 2.6, 1);
  ASSERT_EQ(3u, report.contacts.size());
  EXPECT_EQ(ForceFate::kRegained, report.contacts[0].fate);
  for (int cart : {1, 2}) {
    const ForceJump& jump = report.contacts[cart];
    EXPECT_EQ(cart, jump.constraint);
    ASSERT_EQ(2u, jump.stages.size()) << "the stages after its own impact";
    for (const StageForce& stage : jump.stages) {
      EXPECT_TRUE(stage.activated.Contains(cart));
      EXPECT_NEAR(1.2, stage.force, 1e-7) << "the drive";
    }
    EXPECT_EQ(ForceFate::kKeeps, jump.fate);
  }
}

TEST(ForceJumps, AReleaseThatCoincidesIsNotABorderline) {
  const ForceJumpReport report = At("wall_and_floor");
  ASSERT_TRUE(report.computed);
  ASSERT_EQ(0, report.contacts.front().constraint);
  for (const StageForce& stage : report.contacts.front().stages) {
    EXPECT_NEAR(0, stage.force, 1e-7) << "at the wall the lift does not depend on the speed";
    EXPECT_LT(stage.rate, -0.1);
  }
  EXPECT_EQ(ForceFate::kReleased, report.contacts.front().fate);
}

TEST(ForceJumps, AContactThatAnImpactLiftsIsReleased) {
  const ForceJumpReport report = At("rocking_block");
  ASSERT_TRUE(report.computed);
  bool released = false;
  for (const ForceJump& jump : report.contacts) {
    released = released || jump.fate == ForceFate::kReleased;
  }
  EXPECT_TRUE(released) << "one corner lets go as the other lands";
}

TEST(ForceJumps, AreNotComputedWhereTheOrderDecidesOrStagesAreTooMany) {
  EXPECT_FALSE(At("rigid_biped").computed);
  EXPECT_TRUE(At(test::Make<test::LegRow<8>>()).computed);
  EXPECT_EQ(8u, At(test::Make<test::LegRow<8>>()).contacts.size());
  EXPECT_EQ(128u, At(test::Make<test::LegRow<8>>()).contacts[3].stages.size());
  EXPECT_FALSE(At(test::Make<test::LegRow<9>>()).computed);
}

}  // namespace
}  // namespace contact_flow
