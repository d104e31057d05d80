// SPDX-License-Identifier: BSD-3-Clause
// The force on a resting contact jumps at other contacts' impacts: it keeps, lets go and is
// regained, or is released. In every case the B-derivative is the limit of one-sided quotients.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

const ContactMode kTable({0}), kCarts({1, 2}), kNone;

/// Contact modes of runs in which the first, the second cart meets its stop first.
/// The carts bounce.
struct PlateCase {
  std::string name;
  ParameterValues parameters;
  std::vector<ContactMode> first_before_second, second_before_first;
  bool differentiable;
};

std::vector<PlateCase> Cases() {
  const ParameterValues keeps = {{"weight", 4}}, regained, borderline = {{"weight", 2.8}};
  const ParameterValues released_late = {{"weight", 0}, {"ratio_second", 0.6}};
  const ParameterValues released_early = {{"weight", -0.8}, {"ratio_second", 0.6}};
  return {
      {"keeps", keeps, {kTable, kTable, kTable}, {kTable, kTable, kTable}, true},
      {"regained", regained, {kTable, kNone, kNone, kTable}, {kTable, kTable, kTable}, true},
      {"released_by_the_last",
       released_late,
       {kTable, kTable, kNone},
       {kTable, kTable, kNone},
       false},
      {"released_by_either",
       released_early,
       {kTable, kTable, kNone},
       {kTable, kNone, kNone},
       false},
      // λ({first}) = 0: what happens between the impacts is not decided to first order.
      {"borderline", borderline, {kTable}, {kTable, kTable, kTable}, true},
  };
}

class DampedPlate : public testing::TestWithParam<PlateCase> {
 protected:
  DampedPlate() : system(MakeModel("damped_plate", GetParam().parameters)) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    const NominalRun& nominal = system->nominal();
    run = Simulate(*system, nominal.x, nominal.u, nominal.duration, options);
    BDerivativeOptions tight;
    tight.tolerance = 1e-12;
    B = DifferentiateOutcome(*system, run, tight);
  }
  std::unique_ptr<MechanicalSystem> system;
  Trajectory run;
  BDerivative B;
};

/// Directions (δz, δx₁, δx₂, δż, δẋ₁, δẋ₂) that keep the plate on the table; δx moves the impacts
/// apart, δẋ too.
std::vector<Vector> PlateDirections(double first, double second) {
  std::vector<Vector> directions(3, Vector::Zero(6));
  directions[0].segment(1, 2) << first, second;
  directions[1].tail(2) << 5 * first, 5 * second;
  directions[2].segment(1, 2) << 0.3 * first, 0.7 * second;
  directions[2].tail(2) << first, 2 * second;
  return directions;
}

TEST_P(DampedPlate, RestsOnTheTableBeforeBothImpacts) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Transition& transition = run.transitions.front();
  EXPECT_EQ(kTable, transition.mode_before);
  EXPECT_EQ(kCarts.Members(), transition.activated);
  EXPECT_EQ(GetParam().second_before_first.back(), transition.mode_after);
  // A contact that is regained gives back at its landing what it took. One that is released rises
  // from the later of the two impacts on, or in one of the orders from the earlier: a kink.
  EXPECT_EQ(GetParam().differentiable, B.IsDifferentiable());
}

void ExpectLimit(const MechanicalSystem& system, const BDerivative& B, const Vector& w,
                 const std::vector<ContactMode>& modes) {
  const NominalRun& nominal = system.nominal();
  const Vector prediction = B(w);
  const QuotientReport report = CompareWithQuotients(system, nominal.x, nominal.u, nominal.duration,
                                                     w, prediction, {1e-2, 3e-3, 1e-3, 3e-4, 1e-4});
  EXPECT_NEAR(1, report.slope, 0.1) << w.transpose();
  // Error O(α): its rate, taken at the largest α, holds for the others, within a factor for what is
  // O(α²) there.
  const double rate = report.samples.front().error / report.samples.front().alpha;
  for (const QuotientSample& sample : report.samples) {
    ASSERT_TRUE(sample.status.ok()) << sample.status.message;
    EXPECT_LE(sample.error, 2 * rate * sample.alpha + 20 * report.resolution / sample.alpha);
    // Events after the cluster's own are far from it: only the first modes count.
    ASSERT_GE(sample.modes.size(), modes.size());
    const std::vector<ContactMode> passed(
        sample.modes.begin(), sample.modes.begin() + static_cast<std::ptrdiff_t>(modes.size()));
    EXPECT_EQ(modes, passed) << "alpha " << sample.alpha << ", w " << w.transpose();
  }
}

TEST_P(DampedPlate, QuotientsConvergeWithTheFirstCartFirst) {
  for (const Vector& w : PlateDirections(-1, 1)) {
    ExpectLimit(*system, B, w, GetParam().first_before_second);
  }
}

TEST_P(DampedPlate, QuotientsConvergeWithTheSecondCartFirst) {
  for (const Vector& w : PlateDirections(1, -1)) {
    ExpectLimit(*system, B, w, GetParam().second_before_first);
  }
}

TEST_P(DampedPlate, FirstOrderTellsTheModesOfPerturbedRuns) {
  const auto expect = [&](const std::vector<ContactMode>& wanted, const Vector& w) {
    std::vector<ContactMode> modes = B.PerturbedModes(w);
    ASSERT_GE(modes.size(), wanted.size());
    modes.resize(wanted.size());
    EXPECT_EQ(wanted, modes) << w.transpose();
  };
  for (const Vector& w : PlateDirections(-1, 1)) expect(GetParam().first_before_second, w);
  for (const Vector& w : PlateDirections(1, -1)) expect(GetParam().second_before_first, w);
}

std::string Name(const testing::TestParamInfo<PlateCase>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Cases, DampedPlate, testing::ValuesIn(Cases()), Name);

/// By hand: between the impacts, τ apart, the plate rises at a = 1.8 N / 1 kg to a speed aτ, and
/// its plastic landing takes that away. To first order it does not move, and both orders have the
/// derivative of the plate that keeps.
TEST(DampedPlateRegained, HasTheDerivativeOfThePlateThatKeeps) {
  const auto differentiate = [](const ParameterValues& parameters) {
    const auto system = MakeModel("damped_plate", parameters);
    const NominalRun& nominal = system->nominal();
    const Trajectory run = Simulate(*system, nominal.x, nominal.u, nominal.duration);
    return DifferentiateOutcome(*system, run).Pieces();
  };
  const PiecewiseLinearMap regained = differentiate({}), keeps = differentiate({{"weight", 4}});
  ASSERT_EQ(2u, regained.pieces().size());
  for (const LinearPiece& piece : regained.pieces()) {
    // Two runs at tolerance 1e-9, tangents of size ~1.
    EXPECT_LE((piece.matrix - keeps.pieces().front().matrix).cwiseAbs().maxCoeff(), 1e-7);
    EXPECT_GT(piece.matrix.cwiseAbs().maxCoeff(), 0.1);
  }
}

}  // namespace
}  // namespace contact_flow
