// SPDX-License-Identifier: BSD-3-Clause
// What Sec. 6.1 of the paper adds: bilateral constraints, SE(3), efforts that depend on
// the contact mode.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "../test_models.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/manifold_projection.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Tight;

/// The state of the jointed biped that has the body state of the rigid one.
Vector Jointed(const Vector& rigid) {
  const double L = 0.5;
  Vector x = Vector::Zero(14);
  const double c = std::cos(rigid(2)), s = std::sin(rigid(2)), rate = rigid(5);
  x(0) = rigid(0);
  x(3) = rigid(1);
  x(6) = rigid(2);
  x(7) = rigid(3);
  x(10) = rigid(4);
  x(13) = rate;
  for (int leg = 0; leg < 2; ++leg) {
    const double h = leg == 0 ? -0.25 : 0.25;
    x(1 + leg) = rigid(0) + h * c + L * s;
    x(4 + leg) = rigid(1) + h * s - L * c;
    x(8 + leg) = rigid(3) + rate * (-h * s + L * c);
    x(11 + leg) = rigid(4) + rate * (h * c + L * s);
  }
  return x;
}

/// The rigid biped in minimal coordinates and with bilateral legs: the same motion through landing,
/// tipping over to the other foot and release, to 1e-8.
TEST(BilateralConstraints, JointedBipedIsTheRigidBiped) {
  const auto rigid = MakeModel("rigid_biped"), jointed = MakeModel("jointed_biped");
  for (const double tilt : {0.1, -0.2, 0.35}) {
    Vector x = rigid->nominal().x;
    x(2) = tilt;
    x(3) = 0.2;
    x(5) = -0.3 * tilt;
    const Trajectory one = Simulate(*rigid, x, Vector(0), 1.6, Tight());
    const Trajectory two = Simulate(*jointed, Jointed(x), Vector(0), 1.6, Tight());
    ASSERT_TRUE(one.status.ok()) << one.status.message;
    ASSERT_TRUE(two.status.ok()) << two.status.message;
    ASSERT_EQ(one.ModeSequence(), two.ModeSequence());
    EXPECT_GE(one.transitions.size(), 2u);
    for (std::size_t k = 0; k < one.transitions.size(); ++k) {
      EXPECT_NEAR(one.transitions[k].t, two.transitions[k].t, 1e-8);
      EXPECT_LE((one.transitions[k].impulse - two.transitions[k].impulse.head(2)).norm(), 1e-8);
    }
    EXPECT_LE((Jointed(one.FinalState()) - two.FinalState()).cwiseAbs().maxCoeff(), 1e-8);
    // The closures hold to rounding at every sample, not only to the order of the integrator.
    ConstraintTerms terms;
    jointed->Constraints(two.FinalState().head(7), two.FinalState().tail(7), &terms);
    EXPECT_LE(terms.gap.tail(4).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LE((terms.jacobian.bottomRows(4) * two.FinalState().tail(7)).norm(), 1e-13);
    // Derivatives along the lifted directions are lifted derivatives (central
    // differences of the lift).
    const BDerivative D = DifferentiateOutcome(*rigid, one),
                      E = DifferentiateOutcome(*jointed, two);
    ASSERT_TRUE(D.status.ok() && E.status.ok());
    const auto lift = [](const Vector& at, const Vector& w) {
      return Vector((Jointed(at + 1e-6 * w) - Jointed(at - 1e-6 * w)) / 2e-6);
    };
    for (int k = 0; k < 6; ++k) {
      const Vector w = Vector::Unit(6, k);
      const Vector lifted = lift(one.FinalState(), D(w));
      EXPECT_LE((E(lift(x, w)) - lifted).cwiseAbs().maxCoeff(), 1e-7 * (1 + lifted.norm()));
    }
  }
}

TEST(BilateralConstraints, StatesOffThemAreRefused) {
  const auto jointed = MakeModel("jointed_biped");
  Vector x = jointed->nominal().x;
  x(1) += 1e-3;
  try {
    Simulate(*jointed, x, Vector(0), 1);
    FAIL();
  } catch (const std::invalid_argument& refusal) {
    EXPECT_NE(std::string::npos, std::string(refusal.what()).find("left_leg_x")) << refusal.what();
  }
  Vector far = x;
  EXPECT_FALSE(ProjectState(*jointed, &far, 1e-4));  // it is 1e-3 away
  far = x;
  EXPECT_TRUE(ProjectState(*jointed, &far, 1e-2));
  EXPECT_TRUE(ProjectState(*jointed, &x));
  EXPECT_EQ(x, far);
  EXPECT_TRUE(Simulate(*jointed, x, Vector(0), 0.2).status.ok());
}

/// In free flight a box keeps its energy and its angular momentum, in world axes, to the tolerance.
TEST(ConfigurationSpaces, FreeBoxKeepsEnergyAndAngularMomentum) {
  const auto box = MakeModel("falling_box", {{"gravity", 0}});
  Vector x = box->nominal().x;
  x.tail(3) << 3, 0.1, -2;
  const Trajectory run = Simulate(*box, x, Vector::Zero(6), 5, Tight());
  ASSERT_TRUE(run.status.ok());
  const Eigen::Vector3d inertia(0.13 / 12, 0.2 / 12, 0.25 / 12);
  const auto momentum = [&](const Vector& at) {
    const Eigen::Quaterniond rotation(at(3), at(4), at(5), at(6));
    return Vector(rotation * inertia.cwiseProduct(at.tail<3>()));
  };
  const auto energy = [&](const Vector& at) {
    return 0.5 * at.tail<3>().dot(inertia.cwiseProduct(at.tail<3>()));
  };
  const Vector end = run.FinalState();
  EXPECT_NEAR(energy(x), energy(end), 1e-11);
  EXPECT_LE((momentum(x) - momentum(end)).norm(), 1e-11);
  EXPECT_NEAR(1, end.segment<4>(3).norm(), 1e-15);
  EXPECT_GT((x.tail(3) - end.tail(3)).norm(), 0.1);  // it does tumble
}

TEST(ConfigurationSpaces, RetractAndDifferenceAreInverse) {
  ConfigurationSpace space(1);
  space.Append(ConfigurationSpace::Factor::kCircle).Append(ConfigurationSpace::Factor::kRotation);
  Vector q(6), eta(5);
  q << 0.3, 2.0, 0.5, -0.5, 0.5, 0.5;
  for (const double size : {1e-9, 1e-3, 0.5, 2.0}) {
    eta << 0.2, 0.1, 0.6 * size, -0.64 * size, 0.48 * size;
    const Vector moved = space.Retract(q, eta);
    EXPECT_NEAR(1, moved.tail(4).norm(), 1e-15);
    EXPECT_LE((space.Difference(moved, q) - eta).norm(), 1e-15 + 1e-14 * size);
  }
  Vector far = q;
  far(1) += 2 * 3.14159265358979323846;
  far.tail(4) *= -1;  // the same rotation
  EXPECT_LE(space.Difference(far, q).norm(), 1e-14);
}

TEST(ConfigurationSpaces, QuaternionsThatAreNotUnitAreRefused) {
  const auto box = MakeModel("falling_box");
  Vector x = box->nominal().x;
  x(3) = 2;
  EXPECT_THROW(Simulate(*box, x, Vector::Zero(6), 1), std::invalid_argument);
}

/// A ball on a floor with a thruster whose thrust grows at one rate in contact and at another in
/// flight: if it is off in the air, the ball can neither stay nor leave when the thrust
/// exceeds its weight.
struct Thruster : test::UnitMasses<2, 1> {
  static constexpr const char* kName = "thruster";
  static constexpr bool kContactEffort = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"y", "clock"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P in_contact = 1, in_flight = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(in_contact, "in_contact", "N/s", "growth of the thrust in contact", Range::kAny);
      visit(in_flight, "in_flight", "N/s", "growth of the thrust in flight", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&, ContactMode mode,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = (mode.Empty() ? p.in_flight : p.in_contact) * q(1) - 1.0;
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

TEST(ContactEffort, SlidingIsRefusedWithFilippovsName) {
  const auto thruster = test::Make<Thruster>();
  Vector x(4);
  x << 0, 0, 0, 1;  // the thrust reaches the weight at t = 1
  const Trajectory run = Simulate(thruster, x, Vector(0), 2);
  EXPECT_EQ(Outcome::kFilippov, run.status.outcome);
  EXPECT_NE(std::string::npos, run.status.message.find("Filippov")) << run.status.message;
  EXPECT_NEAR(1, run.t_end(), 1e-9);
  EXPECT_FALSE(DifferentiateOutcome(thruster, run).status.ok());
}

/// With more thrust in flight both fields cross λ = 0 the same way: the ball leaves at t = 1 with ÿ
/// = 3t − 1, so that y(2) = 3/2, ẏ(2) = 7/2, ÿ(2) = 5, and a clock that is ahead by δ gives it δ
/// seconds more.
TEST(ContactEffort, TransversalReleaseHasADerivative) {
  const auto thruster = test::Make<Thruster>({{"in_flight", 3}});
  Vector x(4);
  x << 0, 0, 0, 1;
  const Trajectory run = Simulate(thruster, x, Vector(0), 2);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_NEAR(1.5, run.FinalState()(0), 1e-9);
  const BDerivative B = DifferentiateOutcome(thruster, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Vector by_clock = B(Vector::Unit(4, 1));
  EXPECT_NEAR(3.5, by_clock(0), 1e-8);
  EXPECT_NEAR(5, by_clock(2), 1e-8);
}

/// At t = ½ both modes fit: λ = ½ in contact, ÿ = ½ in flight.
TEST(ContactEffort, AmbiguousStatesAreRefused) {
  const auto thruster = test::Make<Thruster>({{"in_flight", 3}});
  Vector x(4);
  x << 0, 0, 0, 1;
  x(1) = 0.5;
  EXPECT_THROW(InitialMode(thruster, x, Vector(0)), std::invalid_argument);
}

/// The chair lands with both feet at once and comes to rest in the ground.
TEST(ContactEffort, ChairLandsOnBothFeet) {
  const auto chair = MakeModel("chair");
  const Trajectory run = Simulate(*chair, chair->nominal().x, Vector(0), 20, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_FALSE(run.transitions.empty());
  EXPECT_EQ(ConstraintSet({0, 1}), run.transitions.front().switched);
  EXPECT_NEAR(std::sqrt(0.4), run.transitions.front().t, 1e-9);
  EXPECT_LE(run.FinalState().tail(3).norm(), 1e-3);
  // At rest both feet carry half the weight each: k·depth = ½.
  ConstraintTerms terms;
  chair->Constraints(run.FinalState().head(3), run.FinalState().tail(3), &terms);
  EXPECT_NEAR(-0.5 / 40, terms.gap(0), 1e-4);
}

/// An input that changes at an instant: free fall upwards and downwards, x(2) by hand.
TEST(InputSchedules, PiecewiseConstantForce) {
  const auto box = MakeModel("falling_box");
  InputSchedule schedule;
  schedule.grid = {0, 0.1, 0.25};
  schedule.values.assign(3, Vector::Zero(6));
  schedule.values[0](2) = 9.81;
  schedule.values[2](0) = 2;
  Vector x = box->nominal().x;
  x(2) = 3;
  const Trajectory run = Simulate(*box, x, schedule, 0.4);
  ASSERT_TRUE(run.status.ok());
  ASSERT_EQ(2u, run.transitions.size());
  EXPECT_TRUE(run.transitions[0].changes_input);
  EXPECT_EQ(0.1, run.transitions[0].t);
  EXPECT_NEAR(3 - 0.5 * 9.81 * 0.3 * 0.3, run.FinalState()(2), 1e-9);
  EXPECT_NEAR(0.2 * 0.4 + 0.5 * 2 * 0.15 * 0.15, run.FinalState()(0), 1e-9);
  schedule.grid[2] = 0.05;
  EXPECT_THROW(Simulate(*box, x, schedule, 0.4), std::invalid_argument);
}

}  // namespace
}  // namespace contact_flow
