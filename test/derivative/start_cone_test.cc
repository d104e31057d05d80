// SPDX-License-Identifier: BSD-3-Clause
// Starts that touch a constraint outside the contact mode.
#include "contact_flow/derivative/start_cone.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Two heights over floors, M = [[1, m], [m, 1]], under constant forces: the first is pressed, the
/// second lifted by `lift`.
struct TwoHeights : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "pair";
  static constexpr std::array<const char*, 2> kCoordinates = {"held", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"held_floor", "floor"};
  template <class P>
  struct Parameters {
    P coupling = 0, lift = 1, restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(coupling, "coupling", "kg", "m", Range::kAny);
      visit(lift, "lift", "N", "", Range::kAny);
      visit(restitution, "restitution", "", "of the second floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                         Eigen::Matrix<S, 2, 2>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(0, 1) = (*M)(1, 0) = S(p.coupling);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(-3.0);
    (*f)(1) = S(p.lift);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1);
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 1 ? p.restitution : 0.0 * p.restitution;
  }
};

struct Started {
  static constexpr double kDuration = 0.5;
  Started(const ParameterValues& values, double speed) : system(test::Make<TwoHeights>(values)) {
    x = Vector::Zero(4);
    x(3) = speed;
    trajectory = Simulate(system, x, Vector(0), Started::kDuration);
    B = DifferentiateOutcome(system, trajectory);
  }
  ValidityRadius Radius(const Vector& w) const {
    return ValidityEstimator(system, trajectory, B)(w);
  }
  ModelSystem<TwoHeights> system;
  Vector x;
  Trajectory trajectory;
  BDerivative B;
};

Vector Direction(double gap, double rate) {
  Vector w = Vector::Zero(4);
  w(1) = gap;
  w(3) = rate;
  return w;
}

TEST(StartCone, RefusesDirectionsIntoAConstraintThatIsTouched) {
  for (double speed : {0.0, 1.0}) {
    const Started run({}, speed);
    ASSERT_TRUE(run.B.status.ok()) << run.B.status.message;
    EXPECT_EQ(ContactMode({0}), run.B.initial_mode);
    EXPECT_EQ(1, run.B.start.Leaves(Direction(-1, 0)));
    try {
      run.B(Direction(-1, 0));
      FAIL() << "was not refused";
    } catch (const std::invalid_argument& refusal) {
      EXPECT_NE(std::string::npos, std::string(refusal.what()).find("'floor'")) << refusal.what();
    }
    EXPECT_EQ(0, run.Radius(Direction(-1, 0)).radius);
    EXPECT_EQ(1, run.Radius(Direction(-1, 0)).constraint);
    EXPECT_FALSE(run.B.IsDifferentiable());
    // Away from it: free motion, δy + T δẏ.
    const Vector away = run.B(Direction(1, 0.5));
    EXPECT_NEAR(1 + 0.5 * Started::kDuration, away(1), 1e-9);
    EXPECT_NEAR(0.5, away(3), 1e-9);
  }
}

/// From rest under the force 1, with δẏ = −1: hit at once, δẏ⁺ = γ.
TEST(StartCone, HitsAtTheStartWithASpeedOfFirstOrder) {
  for (double restitution : {0.0, 0.6}) {
    const Started run({{"restitution", restitution}}, 0);
    const Vector B = run.B(Direction(0, -1));
    EXPECT_NEAR(restitution * Started::kDuration, B(1), 1e-9);
    EXPECT_NEAR(restitution, B(3), 1e-9);
    // The limit of runs that begin α² above: y = α², ẏ = −α, which fall for a time O(α).
    const double alpha = 1e-5;
    Vector above = run.x;
    above(1) = 0.1 * alpha * alpha;
    above(3) = -alpha;
    SimulateOptions options;
    options.speed_tolerance = options.gap_tolerance = 1e-13;
    options.relative_tolerance = options.absolute_tolerance = 1e-13;
    const Trajectory near = Simulate(run.system, above, Vector(0), Started::kDuration, options);
    ASSERT_TRUE(near.status.ok()) << near.status.message;
    // The speed of the hit is √(1 − 0.2) α, and 1 − √0.8 of α is spent on the way: by closed form
    // y(T) = (T − t)²/2 + γ √0.8 α (T − t), t = (1 − √0.8) α.
    const double t = (1 - std::sqrt(0.8)) * alpha, left = Started::kDuration - t;
    EXPECT_NEAR(left * left / 2 + restitution * std::sqrt(0.8) * alpha * left, near.FinalState()(1),
                1e-11);
    EXPECT_FALSE(run.B.PiecewiseLinear().ok());
    EXPECT_THROW(run.B.Pieces(), NotPiecewiseLinear);
  }
}

/// M⁻¹ lifts the held contact where y is hit, m being −0.4. Complementarity lets it go, and how it
/// returns is not followed; by projection both are held, and nothing is left of δẏ = −1. The other
/// way round, y is not hit for δẏ = 1 by either law.
TEST(StartCone, HitsByTheLawOfTheRun) {
  const auto system = test::Make<TwoHeights>({{"coupling", -0.4}});
  const Vector x = Vector::Zero(4), into = Direction(0, -1), off = Direction(0, 1);
  for (ImpactLaw law : {ImpactLaw::kComplementarity, ImpactLaw::kProjection}) {
    SimulateOptions options;
    options.impact_law = law;
    const Trajectory run = Simulate(system, x, Vector(0), Started::kDuration, options);
    const BDerivative B = DifferentiateOutcome(system, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    EXPECT_NEAR(1, B(off)(3), 1e-9);
    if (law == ImpactLaw::kComplementarity) {
      EXPECT_THROW(B(into), std::domain_error);
    } else {
      EXPECT_LT(B(into).norm(), 1e-9);
    }
  }
}

/// y = αg − αr t + t²/2 touches zero at α = 2g/r².
TEST(StartCone, RadiusOfADirectionThatFallsFirst) {
  const Started run({}, 0);
  const Vector w = Direction(1e-3, -0.1);
  const ValidityRadius radius = run.Radius(w);
  EXPECT_NEAR(0.2, radius.radius, 1e-9);
  EXPECT_EQ(1, radius.constraint);
  const auto outcome = [&](double alpha) {
    const Vector x = run.system.Perturb(run.x, alpha * w);
    const Trajectory there = Simulate(run.system, x, Vector(0), Started::kDuration);
    return Vector((there.FinalState() - run.trajectory.FinalState()) / alpha);
  };
  EXPECT_LE((outcome(0.19) - run.B(w)).cwiseAbs().maxCoeff(), 1e-7) << "linear inside";
  EXPECT_GT((outcome(0.3) - run.B(w)).cwiseAbs().maxCoeff(), 1e-3) << "hit outside";
}

TEST(StartCone, PiecesAreRestrictedWhereTheStartLeavesWithSpeed) {
  const Started run({}, 1);
  const PiecewiseLinearMap map = run.B.Pieces();
  ASSERT_EQ(1u, map.pieces().size());
  EXPECT_LE((map.pieces()[0].cone - Direction(1, 0).transpose()).norm(), 1e-12);
  EXPECT_NEAR(1, run.Radius(Direction(0, -1)).radius, 1e-9) << "it would not leave beyond";
}

/// What touches, and what rests, is what the run took for it.
TEST(StartCone, TakesTheTolerancesOfTheRun) {
  const auto system = test::Make<TwoHeights>({});
  Vector x = Vector::Zero(4);
  x(1) = 5e-9;
  SimulateOptions options;
  const Trajectory above = Simulate(system, x, Vector(0), Started::kDuration, options);
  EXPECT_TRUE(DifferentiateOutcome(system, above).start.Empty());
  options.gap_tolerance = 1e-8;
  const Trajectory touching = Simulate(system, x, Vector(0), Started::kDuration, options);
  const BDerivative B = DifferentiateOutcome(system, touching);
  EXPECT_FALSE(B.start.Empty());
  EXPECT_THROW(B(Direction(-1, 0)), std::invalid_argument);
  x(1) = 0;
  x(3) = 1e-5;
  const Trajectory leaving = Simulate(system, x, Vector(0), Started::kDuration);
  EXPECT_NEAR(-1, DifferentiateOutcome(system, leaving)(Direction(0, -1))(3), 1e-9) << "it leaves";
  options.speed_tolerance = 1e-4;
  const Trajectory resting = Simulate(system, x, Vector(0), Started::kDuration, options);
  EXPECT_NEAR(0, DifferentiateOutcome(system, resting)(Direction(0, -1))(3), 1e-9) << "it rests";
}

/// A mark is a start: the rolling derivative passes what the derivative of a run from there passes.
TEST(StartCone, IsPartOfTheRollingDerivative) {
  const ParameterValues values = {{"restitution", 0.6}};
  const auto system = std::make_shared<ModelSystem<TwoHeights>>(values);
  Matrix directions(4, 3);
  directions << Direction(0, -1), Direction(1, 0.5), Direction(0, 2);
  OnlineFlow run(system, 0, Vector::Zero(4), Vector(0), {});
  RollingDerivative rolling(&run, directions, {}, {});
  rolling.Follow(&run, run.AdvanceTo(Started::kDuration));
  const RollingDerivative::Reading reading = rolling.Read(&run);
  ASSERT_TRUE(reading.status.ok()) << reading.status.message;
  const Started started(values, 0);
  for (int j = 0; j < 3; ++j) {
    // Polynomials of second degree: rounding.
    EXPECT_LE((reading.tangents.col(j) - started.B(directions.col(j))).norm(), 1e-12) << j;
  }
  EXPECT_NEAR(0.6, reading.tangents(3, 0), 1e-12) << "hit at once";
  OnlineFlow again(system, 0, Vector::Zero(4), Vector(0), {});
  const RollingDerivative out(&again, Direction(-1, 0), {}, {});
  EXPECT_EQ(Outcome::kNotDifferentiable, out.status().outcome);
  EXPECT_NE(std::string::npos, out.status().message.find("'floor'")) << out.status().message;
}

TEST(StartCone, RefusesAStartThatNeitherLeavesNorIsPressed) {
  const Started run({{"lift", 0.0}}, 0);
  EXPECT_EQ(Outcome::kNotDifferentiable, run.B.status.outcome);
  EXPECT_NE(std::string::npos, run.B.status.message.find("'floor'")) << run.B.status.message;
}

/// The contact of the mode takes part: pressed by the impact (G_01 < 0) it answers, and both rest.
TEST(StartCone, ContactsOfTheModeTakePart) {
  const Started pressed({{"coupling", 0.5}}, 0);
  ASSERT_EQ(ContactMode({0}), pressed.B.initial_mode);
  EXPECT_LE(pressed.B(Direction(0, -1)).cwiseAbs().maxCoeff(), 1e-12);
  const Started lifted({{"coupling", -0.5}, {"lift", 3.0}}, 0);
  ASSERT_EQ(ContactMode({0}), lifted.B.initial_mode);
  EXPECT_THROW(lifted.B(Direction(0, -1)), std::domain_error);
}

}  // namespace
}  // namespace contact_flow
