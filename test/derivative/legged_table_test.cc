// SPDX-License-Identifier: BSD-3-Clause
// Four feet land at once: all 24 pieces of the B-derivative, each against one-sided quotients
// inside its cone.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace {

constexpr int kFeet = 4, kOrders = 24, kFirstFoot = 2;

class Table : public testing::Test {
 protected:
  explicit Table(const ParameterValues& parameters = {})
      : system(MakeModel("legged_table", parameters)), nominal(system->nominal()) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    run = Simulate(*system, nominal.x, Vector(0), nominal.duration, options);
    BDerivativeOptions tight;
    tight.tolerance = 1e-12;
    B = DifferentiateOutcome(*system, run, tight);
  }
  Vector RandomDirection() {
    std::normal_distribution<double> normal;
    Vector w(nominal.x.size());
    for (int i = 0; i < w.size(); ++i) w(i) = normal(generator);
    return w;
  }
  /// An initial direction after which the feet land in this order, evenly spaced in time.
  Vector DirectionOf(const std::vector<int>& order) {
    Vector at_landing = RandomDirection();
    for (int k = 0; k < kFeet; ++k) at_landing(kFirstFoot + order[k]) = 0.3 * (k - 1.5);
    return B.arcs.front().partialPivLu().solve(at_landing);
  }

  std::unique_ptr<MechanicalSystem> system;
  NominalRun nominal;
  Trajectory run;
  BDerivative B;
  std::mt19937 generator{3};
};

TEST_F(Table, LandsOnAllFeetAtOnce) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  ASSERT_EQ(1u, run.transitions.size());
  EXPECT_EQ(kFeet, run.transitions.front().activated.Size());
  EXPECT_NEAR(std::sqrt(2 * 0.1 / 9.81), run.transitions.front().t, 1e-11);
  EXPECT_EQ(kFeet, run.transitions.front().mode_after.Size());
}

TEST_F(Table, HasTwentyFourDifferentPieces) {
  const PiecewiseLinearMap map = B.Pieces();
  ASSERT_EQ(static_cast<std::size_t>(kOrders), map.pieces().size());
  EXPECT_FALSE(B.IsDifferentiable());
  double closest = 1e9;
  for (int i = 0; i < kOrders; ++i) {
    for (int j = 0; j < i; ++j) {
      const Matrix difference = map.pieces()[i].matrix - map.pieces()[j].matrix;
      closest = std::min(closest, difference.cwiseAbs().maxCoeff());
    }
  }
  // Swapping two neighbours changes the pitch by 2·flywheel·(ż/I)·(time left) ≈ 0.1 a
  // unit of foot height.
  EXPECT_GT(closest, 1e-2);
}

TEST_F(Table, ConesCoverTheSpaceOnce) {
  const PiecewiseLinearMap map = B.Pieces();
  std::vector<int> hits(kOrders, 0);
  for (int trial = 0; trial < 2000; ++trial) {
    const Vector w = RandomDirection();
    int inside = 0;
    for (int i = 0; i < kOrders; ++i) {
      if (map.pieces()[i].Margin(w) < 0) continue;
      ++inside;
      ++hits[i];
      EXPECT_LE((map.pieces()[i].matrix * w - B(w)).cwiseAbs().maxCoeff(), 1e-10);
    }
    EXPECT_EQ(1, inside);
  }
  EXPECT_GT(*std::min_element(hits.begin(), hits.end()), 0) << "a cone was never met";
}

TEST_F(Table, EveryPieceAgreesWithOneSidedQuotientsInItsInterior) {
  const PiecewiseLinearMap map = B.Pieces();
  const std::vector<std::string>& names = system->description().constraints;
  std::vector<int> order = {0, 1, 2, 3};
  int pieces = 0;
  do {
    const Vector w = DirectionOf(order);
    std::vector<std::string> omega;
    for (int foot : order) omega.push_back(names[foot]);
    const auto piece = std::find_if(map.pieces().begin(), map.pieces().end(),
                                    [&](const LinearPiece& p) { return p.omega.front() == omega; });
    ASSERT_NE(map.pieces().end(), piece);
    EXPECT_GT(piece->Margin(w), 0.05);
    const QuotientReport report =
        CompareWithQuotients(*system, nominal.x, Vector(0), nominal.duration, w, piece->matrix * w,
                             {1e-3, 3e-4, 1e-4, 3e-5});
    EXPECT_NEAR(1, report.slope, 0.1) << omega[0] << omega[1] << omega[2];
    const double rate = report.samples.front().error / report.samples.front().alpha;
    for (const QuotientSample& sample : report.samples) {
      EXPECT_LE(sample.error, 2 * rate * sample.alpha + 20 * report.resolution / sample.alpha);
      ContactMode landed;
      ASSERT_EQ(kFeet + 1u, sample.modes.size()) << "the feet land one by one";
      for (int k = 0; k < kFeet; ++k) {
        landed.Insert(order[k]);
        EXPECT_EQ(landed, sample.modes[k + 1]);
      }
    }
    ++pieces;
  } while (std::next_permutation(order.begin(), order.end()));
  EXPECT_EQ(kOrders, pieces);
}

struct TableWithoutFlywheel : Table {
  TableWithoutFlywheel() : Table({{"flywheel", 0}}) {}
};

TEST_F(TableWithoutFlywheel, IsDifferentiable) {
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B.IsDifferentiable());
  EXPECT_LE(B.Pieces().Kink(), 1e-10);
}

}  // namespace
}  // namespace contact_flow
