// SPDX-License-Identifier: BSD-3-Clause
// Derivatives across impacts that contacts share which touch without force.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/linearization.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/flow/simulate.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

/// Three balls in a row on a line, without forces.
struct Balls : test::UnitMasses<3, 2> {
  static constexpr const char* kName = "balls";
  static constexpr std::array<const char*, 3> kCoordinates = {"x1", "x2", "x3"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first_pair", "second_pair"};
  template <class P>
  struct Parameters {
    P first = 0, second = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(first, "first", "", "restitution of the first pair", Range::kUnitInterval);
      visit(second, "second", "", "restitution of the second pair", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    for (int i = 0; i < 3; ++i) (*f)(i) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1) - q(0);
    (*a)(1) = q(2) - q(1);
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.first : p.second;
  }
};

std::shared_ptr<const MechanicalSystem> Shared(const ParameterValues& values) {
  return std::make_shared<ModelSystem<Balls>>(values);
}

/// The last two touch; the first hits them at t = 0.5 s.
Vector Touching() {
  Vector x = Vector::Zero(6);
  x(0) = -0.5;
  x(3) = 1;
  return x;
}

/// The second ball meets the third at t = 0.2 s and, where that is plastic, goes on with it without
/// force at 0.25 m/s; the first hits them at t = 31/15 s.
Vector Meeting() {
  Vector x = Vector::Zero(6);
  x << -1.5, 0, 0.1, 1, 0.5, 0;
  return x;
}

void ExpectDiscontinuous(const BDerivative& B, double t) {
  EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome) << B.status.message;
  for (const char* word : {"second_pair", "touch without force", "Newton", "discontinuous"}) {
    EXPECT_NE(std::string::npos, B.status.message.find(word)) << B.status.message;
  }
  EXPECT_NE(std::string::npos, B.status.message.find("t = " + std::to_string(t).substr(0, 3)))
      << B.status.message;
}

bool Lists(const BDerivative& B, const Vector& v_plus) {
  const auto& outcomes = B.events.back().outcomes();
  return std::any_of(outcomes.begin(), outcomes.end(), [&](const OrderOutcome& outcome) {
    return (outcome.v_plus - v_plus).norm() < 1e-12;
  });
}

/// Touching, Newton's law for all at once gives (−1/3, 2/3, 2/3); a little apart, (0, 0, 1).
TEST(TouchingContacts, TheOutcomeOfNewtonsCradleIsDiscontinuous) {
  const auto system = test::Make<Balls>({{"first", 1}, {"second", 1}});
  const Trajectory run = Simulate(system, Touching(), Vector(0), 1);
  const BDerivative B = DifferentiateOutcome(system, run);
  ExpectDiscontinuous(B, 0.5);
  EXPECT_TRUE(Lists(B, Eigen::Vector3d(-1.0 / 3, 2.0 / 3, 2.0 / 3)));
  EXPECT_TRUE(Lists(B, Eigen::Vector3d(0, 0, 1)));
}

/// An elastic ball that hits a pair which moves on together since it met plastically: at once
/// or one after another. Da v = (−0.75, 0) before; at once Da v⁺ = (0.75, 0), momentum 1.5:
/// v⁺ = (0, 0.75, 0.75). One after another: (0.25, 1, 0.25), then the plastic pair (0.625, 0.625).
TEST(TouchingContacts, APairThatMetWithoutForceIsHitDiscontinuously) {
  const auto system = test::Make<Balls>({{"first", 1}});
  const Trajectory run = Simulate(system, Meeting(), Vector(0), 4);
  ASSERT_EQ(2u, run.transitions.size());
  ASSERT_EQ(ConstraintSet({1}), run.transitions[1].touching);
  const BDerivative B = DifferentiateOutcome(system, run);
  ExpectDiscontinuous(B, 2.06667);
  EXPECT_TRUE(Lists(B, Eigen::Vector3d(0, 0.75, 0.75)));
  EXPECT_TRUE(Lists(B, Eigen::Vector3d(0.25, 0.625, 0.625)));
  OnlineFlow flow(Shared({{"first", 1}}), 0, Meeting(), Vector(0), {});
  RollingDerivative rolling(&flow, Matrix::Identity(6, 6), {}, {});
  while (flow.now() < 4) rolling.Follow(&flow, flow.AdvanceTo(4));
  EXPECT_EQ(Outcome::kDiscontinuous, rolling.status().outcome) << rolling.status().message;
}

/// Plastic balls end up together whether they touch or not, and every perturbed run has the last
/// two together when the first comes: the derivative stays. All three go on at V = 0.5 from where
/// they are when all have met: x_i(T) = ∑x/3 + T ∑v/3, by momentum, in every direction.
TEST(TouchingContacts, PlasticBallsKeepTheirDerivative) {
  const auto system = test::Make<Balls>({});
  const double T = 4;
  const Trajectory run = Simulate(system, Meeting(), Vector(0), T);
  ASSERT_EQ(2u, run.transitions.size());
  ASSERT_EQ(ConstraintSet({1}), run.transitions[1].touching);
  const BDerivative B = DifferentiateOutcome(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  EXPECT_TRUE(B.IsDifferentiable());
  for (int k = 0; k < 6; ++k) {
    const Vector w = Vector::Unit(6, k), found = B(w);
    for (int i = 0; i < 3; ++i) {
      // Rounding of products of matrices of size 4.
      EXPECT_NEAR((k < 3 ? 1 : T) / 3, found(i), 1e-12) << k;
      EXPECT_NEAR(k < 3 ? 0 : 1.0 / 3, found(3 + i), 1e-12) << k;
    }
  }
  OnlineFlow flow(Shared({}), 0, Meeting(), Vector(0), {});
  RollingDerivative rolling(&flow, Matrix::Identity(6, 6), {}, {});
  while (flow.now() < T) rolling.Follow(&flow, flow.AdvanceTo(T));
  const RollingDerivative::Reading reading = rolling.Read(&flow);
  ASSERT_TRUE(reading.status.ok()) << reading.status.message;
  EXPECT_NEAR(T / 3, reading.tangents(0, 3), 1e-12);
}

/// From a start that touches, directions may open the pair: whether and when it is met again is not
/// decided by first order.
TEST(TouchingContacts, AStartThatTouchesWithoutForceIsRefused) {
  const auto system = test::Make<Balls>({});
  const Trajectory run = Simulate(system, Touching(), Vector(0), 1);
  const BDerivative B = DifferentiateOutcome(system, run);
  EXPECT_EQ(Outcome::kNotDifferentiable, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("second_pair")) << B.status.message;
}

/// An interval of inputs that begins between the two impacts: its directions open the pair.
TEST(TouchingContacts, AnIntervalThatBeginsTouchingIsRefused) {
  const auto system = test::Make<Balls>({});
  const InputSchedule schedule{{0, 1}, {Vector(0), Vector(0)}};
  const Trajectory run = Simulate(system, Meeting(), schedule, 4);
  const auto intervals = Linearize(system, run);
  ASSERT_EQ(2u, intervals.size());
  EXPECT_TRUE(intervals[0].status.ok()) << intervals[0].status.message;
  EXPECT_EQ(Outcome::kNotDifferentiable, intervals[1].status.outcome);
  const std::string& message = intervals[1].status.message;
  EXPECT_NE(std::string::npos, message.find("second_pair")) << message;
  EXPECT_NE(std::string::npos, message.find("may touch it earlier, later or not")) << message;
}

}  // namespace
}  // namespace contact_flow
