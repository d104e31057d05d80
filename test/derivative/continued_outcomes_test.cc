// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/derivative/continued_outcomes.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;

const InputSchedule kNoInput = InputSchedule::Constant(Vector(0));

/// A model's nominal run, whose first transition is a cluster in which the order decides.
struct Landing {
  explicit Landing(const std::string& model, const ParameterValues& parameters = {})
      : system(MakeModel(model, parameters)), nominal(system->nominal()) {
    run = Simulate(*system, nominal.x, Vector(0), nominal.duration, AtTolerance(1e-11));
    B = DifferentiateOutcome(*system, run);
  }
  const Transition& cluster() const { return run.transitions.front(); }
  const std::vector<OrderOutcome>& orders() const { return B.events.front().outcomes(); }
  std::vector<ContinuedOutcome> Continue(double t_end) const {
    return ContinueOutcomes(*system, kNoInput, cluster(), orders(), t_end, AtTolerance(1e-11));
  }
  /// The nominal run with gaps that close later by so much [m]: the order of touchdowns
  /// is that of `gaps`.
  Trajectory WithGaps(const Eigen::Vector2d& gaps, double t_end) const {
    const int d = system->dof();
    ConstraintTerms terms;
    const Vector& touch = cluster().x_minus;
    system->Constraints(touch.head(d), touch.tail(d), &terms);
    Vector x = nominal.x;
    x.head(d) +=
        terms.jacobian.transpose() * (terms.jacobian * terms.jacobian.transpose()).inverse() * gaps;
    SimulateOptions options = AtTolerance(1e-11);
    options.simultaneity_tolerance = options.zeno_interval = 1e-4 * gaps.cwiseAbs().maxCoeff();
    return Simulate(*system, x, Vector(0), t_end, options);
  }

  std::unique_ptr<MechanicalSystem> system;
  NominalRun nominal;
  Trajectory run;
  BDerivative B;
};

/// What tolerance 1e-11 leaves in a final state.
constexpr double kRounding = 1e-9;

double Distance(const Vector& a, const Vector& b) { return (a - b).cwiseAbs().maxCoeff(); }

/// The three outcomes at the horizon: each continued order is the limit of runs perturbed to meet
/// the contacts in that order, the nominal run is that of runs that meet them at once. The
/// perturbed runs' distance is O(α): it falls by 10 a decade, asked for is 4.
void ExpectLimitsAtTheHorizon(const Landing& landing, double t_end) {
  ASSERT_EQ(Outcome::kDiscontinuous, landing.B.status.outcome);
  ASSERT_EQ(2u, landing.orders().size());
  const std::vector<ContinuedOutcome> ends = landing.Continue(t_end);
  ASSERT_EQ(2u, ends.size());
  const Trajectory both =
      Simulate(*landing.system, landing.nominal.x, Vector(0), t_end, AtTolerance(1e-11));
  for (std::size_t k = 0; k < 2; ++k) {
    ASSERT_TRUE(ends[k].status.ok()) << ends[k].status.message;
    EXPECT_EQ(landing.orders()[k].mode_after, ends[k].modes.front());
    const int first = landing.orders()[k].order.front();
    double last = std::numeric_limits<double>::infinity();
    for (double alpha : {1e-4, 1e-5, 1e-6, 1e-7}) {
      Eigen::Vector2d gaps = Eigen::Vector2d::Zero();
      gaps(first) = -alpha;
      const Trajectory run = landing.WithGaps(gaps, t_end);
      ASSERT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(ConstraintSet({first}), run.transitions.front().activated);
      const double distance = Distance(run.FinalState(), ends[k].final_state);
      EXPECT_LE(distance, 0.25 * last) << "alpha " << alpha << ", first " << first;
      last = distance;
    }
    EXPECT_LE(last, 1e-4);
    EXPECT_GT(Distance(ends[k].final_state, both.FinalState()), 0.1);
  }
  EXPECT_GT(Distance(ends[0].final_state, ends[1].final_state), 0.1);
  double last = std::numeric_limits<double>::infinity();
  for (double alpha : {1e-4, 1e-5, 1e-6}) {
    SimulateOptions options = AtTolerance(1e-11);
    Vector x = landing.nominal.x;
    x(1) -= alpha;  // body_z: both land earlier
    const Trajectory run = Simulate(*landing.system, x, Vector(0), t_end, options);
    const double distance = Distance(run.FinalState(), both.FinalState());
    EXPECT_LE(distance, 0.25 * last + kRounding);  // the biped comes to rest: the limit is reached
    last = distance;
  }
}

TEST(ContinuedOutcomes, OfTheRigidBipedAreTheLimitsOfPerturbedRuns) {
  const Landing landing("rigid_biped");
  ExpectLimitsAtTheHorizon(landing, landing.nominal.duration);
}

TEST(ContinuedOutcomes, OfTheQuadrupedAreTheLimitsOfPerturbedRuns) {
  const Landing landing("rigid_quadruped");
  ExpectLimitsAtTheHorizon(landing, landing.nominal.duration);
}

/// Thrown out of an acute, elastic corner, under gravity alone: x(T) = v⁺t + g t²/2.
TEST(ContinuedOutcomes, OfTheCornerFlyFreely) {
  const Landing landing("corner", {{"angle", M_PI / 3}, {"restitution", 0.5}});
  constexpr double kLater = 0.01;
  const std::vector<ContinuedOutcome> ends = landing.Continue(landing.cluster().t + kLater);
  ASSERT_EQ(2u, ends.size());
  int flying = 0;
  for (std::size_t k = 0; k < ends.size(); ++k) {
    ASSERT_TRUE(ends[k].status.ok()) << ends[k].status.message;
    if (ends[k].modes != std::vector<ContactMode>{ContactMode()}) continue;
    const Eigen::Vector2d gravity(2, -9.81), v = landing.orders()[k].v_plus;
    Vector x(4);
    x << v * kLater + gravity * (kLater * kLater / 2), v + gravity * kLater;
    // The corner is located to 1e-10 of 1 m; the motion is a polynomial.
    EXPECT_LE(Distance(x, ends[k].final_state), 1e-9);
    ++flying;
  }
  EXPECT_GT(flying, 0);
}

TEST(ContinuedOutcomes, BeginWithTheOutcomeItself) {
  const Landing landing("rigid_biped");
  const std::vector<ContinuedOutcome> ends = landing.Continue(landing.cluster().t);
  for (std::size_t k = 0; k < ends.size(); ++k) {
    EXPECT_TRUE(ends[k].status.ok());
    EXPECT_EQ(landing.cluster().x_minus.head(3), ends[k].final_state.head(3));
    EXPECT_EQ(landing.orders()[k].v_plus, ends[k].final_state.tail(3));
  }
}

/// A cluster with a spread of 1e-7 s is located with gaps of 1e-7 m, of either sign:
/// contacts are kept.
TEST(ContinuedOutcomes, KeepContactsWhoseGapTheSpreadLeavesOpen) {
  const Landing landing("rigid_biped");
  for (double spread : {-8e-8, 8e-8}) {
    Transition cluster = landing.cluster();
    cluster.x_minus(1) += spread;
    const std::vector<ContinuedOutcome> ends =
        ContinueOutcomes(*landing.system, kNoInput, cluster, landing.orders(),
                         landing.nominal.duration, AtTolerance(1e-11));
    const std::vector<ContinuedOutcome> wanted = landing.Continue(landing.nominal.duration);
    for (std::size_t k = 0; k < ends.size(); ++k) {
      ASSERT_TRUE(ends[k].status.ok()) << ends[k].status.message;
      EXPECT_EQ(wanted[k].modes, ends[k].modes);
      // 8e-8 times the growth over 0.4 s, of order 10.
      EXPECT_LE(Distance(wanted[k].final_state, ends[k].final_state), 1e-5);
    }
  }
}

/// In a wedge of 0.1 rad a ball bounces about π/0.1 times before it comes out.
TEST(ContinuedOutcomes, OfSequencesThatWereCutAreRefused) {
  const Landing landing(
      "corner", {{"angle", M_PI - 0.1}, {"restitution", 0.99}, {"gravity_x", 0}, {"gravity_y", 0}});
  ASSERT_EQ(2u, landing.orders().size());
  for (const ContinuedOutcome& end : landing.Continue(landing.nominal.duration)) {
    EXPECT_EQ(Outcome::kZeno, end.status.outcome);
    EXPECT_NE(std::string::npos, end.status.message.find("after 8 impacts"));
    EXPECT_EQ(0, end.final_state.size());
  }
  for (const OrderOutcome& order : landing.orders())
    EXPECT_EQ(Outcome::kZeno, order.status.outcome);
  for (const OrderOutcome& order : Landing("rigid_biped").orders()) EXPECT_TRUE(order.status.ok());
}

/// The flight to the corner, taken for a continuation, meets a cluster whose order decides.
TEST(ContinuedOutcomes, SayWhenTheOrderDecidesOnceMore) {
  const Landing landing("corner", {{"angle", M_PI / 3}});
  Transition start = landing.cluster();
  start.t = 5;
  start.x_minus = landing.nominal.x;
  start.activated = ConstraintSet();
  start.mode_before = ContactMode();
  OrderOutcome flight;
  flight.v_plus = landing.nominal.x.tail(2);
  const std::vector<ContinuedOutcome> ends = ContinueOutcomes(
      *landing.system, kNoInput, start, {flight, flight}, 5.25, AtTolerance(1e-11));
  ASSERT_EQ(2u, ends.size());
  EXPECT_EQ(ends[0].final_state, ends[1].final_state);
  EXPECT_EQ(Outcome::kDiscontinuous, ends[0].status.outcome);
  EXPECT_NE(std::string::npos, ends[0].status.message.find("at t = 5.2 s"))
      << ends[0].status.message;
  EXPECT_EQ(4, ends[0].final_state.size());
}

TEST(ContinuedOutcomes, HaveAStatusOfTheirOwn) {
  const Landing landing("rigid_biped");
  SimulateOptions options = AtTolerance(1e-11);
  options.max_steps = 1;
  for (const ContinuedOutcome& end :
       ContinueOutcomes(*landing.system, kNoInput, landing.cluster(), landing.orders(),
                        landing.nominal.duration, options)) {
    EXPECT_EQ(Outcome::kBudgetExceeded, end.status.outcome);
  }
  OrderOutcome many = landing.orders().front();
  std::vector<OrderOutcome> orders;
  for (int k = 0; k <= kMaxContinuedOutcomes; ++k) {
    many.v_plus(0) += 1e-3;
    orders.push_back(many);
  }
  EXPECT_THROW(ContinueOutcomes(*landing.system, kNoInput, landing.cluster(), orders,
                                landing.cluster().t, options),
               std::length_error);
}

}  // namespace
}  // namespace contact_flow
