// SPDX-License-Identifier: BSD-3-Clause
// Changes of the input that coincide with events of contacts: closed form, quotients of plain runs,
// pieces, laws.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <random>
#include <set>

#include "contact_flow/analysis/input_map.h"
#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/cluster_reading.h"
#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/derivative/input_cases.h"

namespace contact_flow {
namespace {

using test::Bodies;
using test::Case;
using test::Named;
using test::Outcome;
using test::PushedBodies;
using test::RandomCase;
using test::WithSimultaneity;

/// The third body is let go and held again at one instant: it touches without speed.
bool Grazes(const Status& status) { return status.message.find("grazing") != std::string::npos; }

/// CONTACT_FLOW_INPUT_CASES: how many.
int NumCases() {
  const char* text = std::getenv("CONTACT_FLOW_INPUT_CASES");
  return text != nullptr ? std::atoi(text) : 42;
}

/// One-sided quotients of plain runs: their error is C α, so that at α/10 it is a tenth; rounding
/// and the integrator leave 1e-13/α ~ 1e-8 at 1e-5, and instants 1e-11 apart the same.
TEST(InputCluster, QuotientsHaveSlopeOneInRandomCases) {
  constexpr double kCoarse = 1e-4, kFine = 1e-5, kNoise = 3e-6;
  int answered = 0, refused = 0, with_rest = 0;
  for (int seed = 0; seed < NumCases(); ++seed) {
    const Case c = RandomCase(seed).Make();
    const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const GridDerivative B(*c.system, run);
    if (Grazes(B.status())) {
      ++refused;
      continue;
    }
    ASSERT_TRUE(B.status().ok()) << seed << ": " << B.status().message;
    ASSERT_EQ(c.schedule.grid.size(), B.intervals().size());
    std::mt19937 random(static_cast<unsigned>(seed) + 1000);
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto K = static_cast<Eigen::Index>(c.schedule.grid.size());
    for (int j = 0; j < 6; ++j) {
      Vector dx = Vector::NullaryExpr(6, [&] { return uniform(random); });
      const Matrix du = Matrix::NullaryExpr(2, K, [&] { return uniform(random); });
      Vector dt;
      if (j % 2 == 1) {
        dt = Vector::NullaryExpr(K - 1, [&] { return 0.1 * uniform(random); });
        if (K == 4 && dt(2) < dt(1)) std::swap(dt(2), dt(1));
      }
      if (c.x(2) == 0) {  // it rests on its floor
        dx(2) = dx(5) = 0;
        ++with_rest;
      }
      Vector exact;
      try {
        exact = B(dx, du, dt);
      } catch (const std::domain_error& reason) {
        ++refused;
        continue;
      }
      ++answered;
      const Vector base = Outcome(c, dx, du, dt, 0);
      const auto error = [&](double alpha) {
        return ((Outcome(c, dx, du, dt, alpha) - base) / alpha - exact).cwiseAbs().maxCoeff();
      };
      const double coarse = error(kCoarse), fine = error(kFine);
      EXPECT_LT(fine, 0.3 * coarse + kNoise * (1 + exact.cwiseAbs().maxCoeff()))
          << "case " << seed << ", direction " << j << ": " << coarse << ", " << fine;
      EXPECT_LT(coarse, 0.05 * (1 + exact.cwiseAbs().maxCoeff()))
          << "case " << seed << ", direction " << j;
    }
  }
  std::printf("%d directions answered, %d refused, %d with a third body at rest\n", answered,
              refused, with_rest);
  EXPECT_GT(answered, 20 * refused);
}

/// m! / c! pieces for m events of which c are changes of the input, each labelled by its order, and
/// together the map that directions have.
TEST(InputCluster, PiecesAreCountedLabelledAndAgreeWithDirections) {
  int counted[3] = {0, 0, 0};
  for (int seed = 0; seed < NumCases(); ++seed) {
    const Case c = RandomCase(seed).Make();
    const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
    const BDerivative B = DifferentiateOutcome(*c.system, run);
    if (Grazes(B.status)) continue;
    ASSERT_TRUE(B.status.ok()) << seed << ": " << B.status.message;
    EXPECT_LT(B.trust.event_law, 1e-7);
    EXPECT_LT(B.trust.face_law, 1e-8);
    if (!B.PiecewiseLinear().ok()) continue;
    std::size_t expected = c.kind == Case::kOneContact ? 2 : c.kind == Case::kTwoContacts ? 6 : 3;
    const EventMap* cluster = nullptr;
    for (const EventMap& event : B.events) {
      if (event.num_input_changes() > 0 && !event.absorbed()) cluster = &event;
    }
    ASSERT_NE(nullptr, cluster);
    const PiecewiseLinearMap pieces = cluster->Pieces(7);
    ASSERT_EQ(expected, pieces.pieces().size()) << seed;
    ++counted[c.kind];
    std::set<std::vector<std::string>> orders;
    for (const LinearPiece& piece : pieces.pieces()) {
      ASSERT_EQ(1u, piece.omega.size());
      orders.insert(piece.omega.front());
      EXPECT_EQ(c.kind == Case::kTwoChanges ? 2 : 1,
                std::count(piece.omega.front().begin(), piece.omega.front().end(), "input change"));
    }
    EXPECT_EQ(expected, orders.size());
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    for (int j = 0; j < 10; ++j) {
      Vector w = Vector::NullaryExpr(6, [&] { return normal(random); });
      if (c.x(2) == 0) w(2) = w(5) = 0;
      EXPECT_LT(((*cluster)(w)-pieces(w)).norm(), 1e-9 * (1 + pieces(w).norm())) << seed;
    }
  }
  for (int count : counted) EXPECT_GT(count, 0);
}

/// A ball of restitution γ over a floor: with the touchdown at the change of the input from f to g
/// velocity changes by −(1+γ) a τ, τ = −δy/v, with the acceleration a on the side of τ.
TEST(InputCluster, BallHasTheClosedForm) {
  PushedBodies::Parameters<double> p;
  p.first = 0.7;
  p.bend = p.coupling = 0;
  const Bodies system(Named(p));
  Vector x(6);
  x << 1, 50, 50, 0, 0, 0;
  const double u0 = 2, u1 = -3, a0 = u0 - 9.8, a1 = u1 - 9.8;
  const double t = std::sqrt(2 / -a0), v = a0 * t, rest = 0.05;
  InputSchedule schedule{{0, t}, {Vector::Unit(2, 0) * u0, Vector::Unit(2, 0) * u1}};
  const Trajectory run = Simulate(system, x, schedule, t + rest, WithSimultaneity(1e-9));
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_FALSE(B.IsDifferentiable());
  for (double dy : {1.0, -1.0}) {
    const Vector result = B(Vector(Vector::Unit(6, 0) * dy));
    // Touchdown at τ = −δy/v after the change where δy > 0, with a1 in between; before it where
    // δy < 0, with a0 in between after the bounce.
    const double tau = -dy / v;
    const double dv = tau > 0 ? -0.7 * a1 * tau - a1 * tau : -0.7 * a0 * tau - a0 * tau;
    const double dq = -0.7 * dy;
    EXPECT_NEAR(dv, result(3), 1e-7);
    EXPECT_NEAR(dq + dv * rest, result(0), 1e-7);
  }
  // The same by the time of the change alone: u0 for longer.
  const GridDerivative grid(system, run);
  ASSERT_TRUE(grid.status().ok());
  const Matrix none = Matrix::Zero(2, 2);
  for (double dt : {1.0, -1.0}) {
    const Vector result = grid(Vector::Zero(6), none, Vector::Constant(1, dt));
    // Later: behind the bounce, (a0 − a1) δt; earlier: before it.
    const double dv = dt > 0 ? (a0 - a1) * dt : -0.7 * (a0 - a1) * dt;
    EXPECT_NEAR(dv, result(3), 1e-7) << dt;
  }
  EXPECT_EQ(B.PerturbedModes(Vector(Vector::Unit(6, 0))).size(), 3u);
  const ValidityEstimator radius(system, run, B);
  EXPECT_GT(radius(Vector(Vector::Unit(6, 0))).radius, 0.05);
}

/// Where the sequence of events is no longer one of those that the pieces unite: in closed form,
/// the touchdown leaves the run.
TEST(InputCluster, RadiusIsWhereEventsLeaveTheRun) {
  PushedBodies::Parameters<double> p;
  p.bend = p.coupling = 0;
  const Bodies system(Named(p));
  Vector x(6);
  x << 1, 50, 50, -1, 0, 0;
  const double a = -9.8, t = (1 - std::sqrt(1 - 2 * a)) / a, v = -1 + a * t, rest = 0.05;
  InputSchedule schedule{{0, t}, {Vector::Zero(2), Vector::Unit(2, 0)}};
  const Trajectory run = Simulate(system, x, schedule, t + rest, WithSimultaneity(1e-9));
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const ValidityEstimator radius(system, run, B);
  // Along δy the touchdown moves by −δy/v: to the horizon.
  const ValidityRadius up = radius(Vector(Vector::Unit(6, 0)));
  EXPECT_EQ(ValidityRadius::Limit::kHorizon, up.limit);
  EXPECT_NEAR(-v * rest, up.radius, 1e-6);
}

/// The derivative that follows an online run, and that of the whole run.
TEST(InputCluster, RollingDerivativeFollows) {
  for (int seed = 0; seed < 9; ++seed) {
    const Case c = RandomCase(seed).Make();
    const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
    BDerivativeOptions options;
    const BDerivative whole = DifferentiateOutcome(*c.system, run, options);
    ASSERT_TRUE(whole.status.ok()) << whole.status.message;
    Matrix directions(6, 4);
    std::mt19937 random(static_cast<unsigned>(seed));
    std::normal_distribution<double> normal;
    for (double& value : directions.reshaped()) value = normal(random);
    if (c.x(2) == 0) directions.row(2).setZero(), directions.row(5).setZero();
    const auto shared = std::shared_ptr<const MechanicalSystem>(c.system.get(), [](auto*) {});
    OnlineFlow flow(shared, 0, c.x, c.schedule.values[0], WithSimultaneity(1e-9));
    for (std::size_t k = 1; k < c.schedule.grid.size(); ++k) {
      flow.SetInput(c.schedule.grid[k], c.schedule.values[k]);
    }
    RollingDerivative rolling(&flow, directions, options, WithSimultaneity(1e-9));
    bool passed = true;
    while (passed) {
      passed = flow.AdvanceTo(c.duration);
      rolling.Follow(&flow, passed);
    }
    const RollingDerivative::Reading reading = rolling.Read(&flow);
    ASSERT_TRUE(reading.status.ok()) << seed << reading.status.message;
    for (int j = 0; j < 4; ++j) {
      const Vector expected = whole(directions.col(j));
      // Each slice has the tangents' tolerance, and instants are 1e-11 apart.
      EXPECT_LT((expected - reading.tangents.col(j)).norm(), 1e-6 * (1 + expected.norm())) << seed;
    }
  }
}

/// A slip in space that ends, or a direction that it begins in, has no place among the orders.
TEST(InputCluster, SlipInSpaceThatEndsIsRefused) {
  const auto puck = MakeModel("puck");
  const NominalRun nominal = puck->nominal();
  const Trajectory alone = Simulate(*puck, nominal.x, nominal.u, nominal.duration);
  const auto stop = std::find_if(
      alone.transitions.begin(), alone.transitions.end(),
      [](const Transition& passed) { return passed.mode_after.LetterOf(0) == Letter::kStick; });
  ASSERT_NE(alone.transitions.end(), stop);
  const InputSchedule schedule{{0, stop->t}, {nominal.u, nominal.u}};
  const Trajectory run = Simulate(*puck, nominal.x, schedule, nominal.duration);
  const BDerivative B = DifferentiateOutcome(*puck, run);
  EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("begins or ends to slip in space"))
      << B.status.message;
}

TEST(InputCluster, InstantsThatWouldChangePlacesAreRefused) {
  const Case c = RandomCase(2).Make();
  ASSERT_EQ(Case::kTwoChanges, c.kind);
  const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
  const GridDerivative B(*c.system, run);
  ASSERT_TRUE(B.status().ok());
  EXPECT_THROW(B(Vector::Zero(6), Matrix::Zero(2, 4), Vector::LinSpaced(3, 1, -1)),
               std::invalid_argument);
  EXPECT_THROW(B(Vector::Zero(5), Matrix::Zero(2, 4)), std::invalid_argument);
  EXPECT_GE(B.PerturbedModes(Vector::Zero(6), Matrix::Ones(2, 4)).size(), 3u);
}

/// Models of the library whose input changes as they first touch: quotients of plain runs.
TEST(InputCluster, QuotientsOfLibraryModels) {
  for (const char* name : {"double_pendulum", "falling_box", "driven_ball"}) {
    Case c;
    c.system = MakeModel(name);
    c.x = c.system->nominal().x;
    const Eigen::Index m = c.system->num_inputs(), d2 = 2 * c.system->dof();
    const Vector first = c.system->nominal().u, next = first + Vector::LinSpaced(m, 0.3, -0.2);
    const double nominal = c.system->nominal().duration;
    const Trajectory free = Simulate(*c.system, c.x, first, nominal, WithSimultaneity(1e-12));
    ASSERT_FALSE(free.transitions.empty()) << name;
    const double hit = free.transitions.front().t;
    c.schedule = {{0, hit / 2, hit}, {first, first, next}};
    c.duration = std::min(nominal, hit + 0.02);
    const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
    ASSERT_TRUE(run.status.ok()) << name << run.status.message;
    const GridDerivative B(*c.system, run);
    ASSERT_TRUE(B.status().ok()) << name << B.status().message;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int j = 0; j < 6; ++j) {
      const Vector dx = Vector::NullaryExpr(d2, [&] { return 0.1 * uniform(random); });
      const Matrix du = Matrix::NullaryExpr(m, 3, [&] { return uniform(random); });
      const Vector dt = Vector::NullaryExpr(2, [&] { return 0.01 * uniform(random); });
      const Vector exact = B(dx, du, dt);
      const auto end = [&](double alpha) {
        InputSchedule schedule = c.schedule;
        for (Eigen::Index k = 0; k < 3; ++k) {
          schedule.values[static_cast<std::size_t>(k)] += alpha * du.col(k);
          if (k > 0) schedule.grid[static_cast<std::size_t>(k)] += alpha * dt(k - 1);
        }
        return Simulate(*c.system, c.system->Perturb(c.x, alpha * dx), schedule, c.duration,
                        WithSimultaneity(1e-13))
            .FinalState();
      };
      const Vector base = end(0);
      const auto error = [&](double alpha) {
        const Vector quotient = c.system->Separation(end(alpha), base) / alpha;
        return (quotient - exact).cwiseAbs().maxCoeff();
      };
      // As above: C α, and 1e-12/α that the integrator leaves.
      EXPECT_LT(error(1e-5), 0.3 * error(1e-4) + 1e-5 * (1 + exact.cwiseAbs().maxCoeff()))
          << name << j;
    }
  }
}

/// Events told apart by 1e-7 s that count as one: how far the order that the run has holds.
TEST(InputCluster, InnerRadiusCountsTheChangeOfTheInput) {
  const auto ball = MakeModel("driven_ball");
  const double t = std::sqrt(8 / 9.8), apart = 1e-7;
  const InputSchedule schedule{{0, t + apart}, {Vector::Zero(1), Vector::Ones(1)}};
  const Trajectory run =
      Simulate(*ball, Eigen::Vector2d(4, 0), schedule, 1, WithSimultaneity(1e-6));
  const BDerivative B = DifferentiateOutcome(*ball, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  // δy = 1 delays the touchdown by 1/(g t): it comes after the change where α is larger than that.
  const ClusterReading up = ReadClusters(B, Eigen::Vector2d(1, 0));
  EXPECT_NEAR(apart * 9.8 * t, up.inner_radius, 1e-3 * up.inner_radius);
  EXPECT_EQ(0, ReadClusters(B, Eigen::Vector2d(-1, 0)).inner_radius);
}

/// The map of all inputs: pieces by the order, the values those of directions.
TEST(InputCluster, InputMapHasThePieces) {
  const Case c = RandomCase(1).Make();
  ASSERT_EQ(Case::kTwoContacts, c.kind);
  const Trajectory run = Simulate(*c.system, c.x, c.schedule, c.duration, WithSimultaneity(1e-9));
  const GridDerivative B(*c.system, run);
  ASSERT_TRUE(B.status().ok());
  const PiecewiseLinearMap map = InputMap(B.intervals());
  EXPECT_EQ(6u, map.pieces().size());
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int j = 0; j < 20; ++j) {
    const Matrix du = Matrix::NullaryExpr(2, 3, [&] { return normal(random); });
    const Vector expected = B(Vector::Zero(6), du);
    EXPECT_LT((map(Vector(du.reshaped())) - expected).norm(), 1e-9 * (1 + expected.norm()));
  }
}

}  // namespace
}  // namespace contact_flow
