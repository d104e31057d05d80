// SPDX-License-Identifier: BSD-3-Clause
// Random clusters of coupled contacts, resting and hit: the verdict against one-sided quotients and
// against perturbed runs, under both impact laws.
#include "contact_flow/derivative/cluster_class.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <iostream>
#include <random>
#include <stdexcept>

#include "contact_flow/analysis/assumptions.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/derivative/random_contacts.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::Contacts;
using test::kImpactLaws;

constexpr double kArrival = 0.05, kDeparture = 0.02;  // [s] before and after the cluster

/// A state from which motion in `mode` arrives at (0, v) after kArrival, by Heun steps backwards in
/// so small steps that the residual gaps (1e-12) stay within the simultaneity tolerance, 1e-9 s.
Vector BeforeCluster(const MechanicalSystem& system, ContactMode mode, const Vector& v) {
  ContactDynamics dynamics(system, Vector(0));
  Vector x = Vector::Zero(2 * v.size());
  x.tail(v.size()) = v;
  constexpr int kSteps = 400;
  const double h = -kArrival / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const Vector k1 = dynamics.Field(x, mode), k2 = dynamics.Field(x + h / 2 * k1, mode),
                 k3 = dynamics.Field(x + h / 2 * k2, mode), k4 = dynamics.Field(x + h * k3, mode);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return x;
}

struct ClusterTally {
  int derivatives = 0, orders_agree = 0, discontinuous = 0, unseen = 0, refused = 0, skipped = 0;
};
std::ostream& operator<<(std::ostream& out, const ClusterTally& t) {
  return out << t.derivatives << " derivatives (" << t.orders_agree
             << " where the orders agree though pairs are coupled), " << t.discontinuous
             << " discontinuous (" << t.unseen << " not shown by the perturbed runs), " << t.refused
             << " refused, " << t.skipped << " skipped";
}

/// Differentiates the run from x and judges the answer.
void Judge(const MechanicalSystem& system, const Vector& x, double duration, ImpactLaw law,
           int impacts, ClusterTally* tally) {
  const int d = system.dof();
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.simultaneity_tolerance = 1e-9;
  options.impact_law = law;
  const Trajectory run = Simulate(system, x, Vector(0), duration, options);
  if (!run.status.ok() || run.transitions.empty() ||
      run.transitions.front().activated.Size() != impacts) {
    ++tally->skipped;
    return;
  }
  EXPECT_EQ(law, run.impact_law);
  const BDerivative B = DifferentiateOutcome(system, run);
  const ClusterReport& cluster = B.events.front().cluster();
  // check_assumptions sees what b_derivative sees.
  const ContactClass assessed = AssessTransitions(system, run).front().contact_class;
  if (impacts > 1) {
    EXPECT_EQ(cluster.contact_class, assessed) << ContactClassName(assessed);
    EXPECT_EQ(cluster.contact_class == ContactClass::kOrderDependent,
              cluster.status.outcome == Outcome::kDiscontinuous);
  }
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    Vector w(2 * d);
    for (int i = 0; i < w.size(); ++i) w(i) = normal(generator);
    return Vector(ProjectAdmissible(system, x, run.arcs.front().mode, w.normalized()).normalized());
  };
  if (B.status.outcome == Outcome::kDiscontinuous) {
    ++tally->discontinuous;
    ASSERT_FALSE(B.events.back().outcomes().empty()) << B.status.message;
    // Some runs that are perturbed by 1e-6 end far away: 1e3 times as far.
    bool seen = false;
    SimulateOptions exact = options;
    exact.simultaneity_tolerance = 1e-12;
    for (int trial = 0; trial < 12 && !seen; ++trial) {
      const Trajectory perturbed =
          Simulate(system, system.Perturb(x, 1e-6 * direction()), Vector(0), duration, exact);
      seen = !perturbed.status.ok() ||
             system.Separation(perturbed.FinalState(), run.FinalState()).norm() > 1e-3;
    }
    tally->unseen += !seen;
    return;
  }
  if (!B.status.ok()) {
    ++tally->refused;
    return;
  }
  ++tally->derivatives;
  tally->orders_agree += cluster.contact_class == ContactClass::kOrdersAgree;
  for (int trial = 0; trial < 4; ++trial) {
    const Vector w = direction();
    if (B.start.Leaves(w) >= 0) continue;
    const Vector prediction = B(w);
    const QuotientReport report = CompareWithQuotients(system, x, Vector(0), duration, w,
                                                       prediction, {1e-4, 1e-5, 1e-6}, options);
    for (const QuotientSample& sample : report.samples) {
      if (!sample.status.ok()) return;  // it grazes: no case for a quotient
    }
    // A wrong derivative is off by O(1) at every α; a right one by O(α), down to the resolution
    // and to what it says it neglects.
    EXPECT_LE(report.samples[2].error,
              0.05 * report.samples[0].error + 1e-4 * (1 + prediction.cwiseAbs().maxCoeff()) +
                  B.neglected_derivative + B.neglected_jump.maxCoeff() / report.samples[2].alpha)
        << B.events.front().cluster().neglected_jump.transpose() << "; "
        << ContactClassName(cluster.contact_class) << ", errors " << report.samples[0].error << " "
        << report.samples[1].error << " " << report.samples[2].error << ", direction "
        << w.transpose();
  }
}

/// A random cluster of Contacts: `resting` rest, `hit` are hit at once.
void CheckContacts(unsigned seed, int kind, ConstraintSet resting, ConstraintSet hit, bool plastic,
                   ImpactLaw law, ClusterTally* tally) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto restitution = [&](int i) {
    return plastic || resting.Contains(i) ? 0.0 : 0.2 + 0.6 * uniform(generator);
  };
  const double gamma[] = {restitution(0), restitution(1), restitution(2), restitution(3)};
  const auto system = test::Make<Contacts>({{"seed", seed},
                                            {"kind", kind},
                                            {"first", gamma[0]},
                                            {"second", gamma[1]},
                                            {"third", gamma[2]},
                                            {"fourth", gamma[3]}});
  const Eigen::Matrix<double, 4, 5> n = Contacts::Normals(seed, kind);
  // Contacts that take no part open.
  Eigen::Vector4d rate;
  for (int i = 0; i < 4; ++i) {
    rate(i) = resting.Contains(i) ? 0 : hit.Contains(i) ? -0.3 - uniform(generator) : -2;
  }
  Vector v = n.transpose() * (n * n.transpose()).ldlt().solve(rate);
  const Vector side = Vector::Random(5);
  v += side - n.transpose() * (n * n.transpose()).ldlt().solve(n * side);
  Vector x = BeforeCluster(system, ContactMode(resting), v);
  // … by starting 0.2 m above.
  Eigen::Vector4d lift = Eigen::Vector4d::Zero();
  for (int i = 0; i < 4; ++i) lift(i) = (resting | hit).Contains(i) ? 0 : 0.4;
  x.head(5) += n.transpose() * (n * n.transpose()).ldlt().solve(lift);
  Judge(system, x, kArrival + kDeparture, law, hit.Size(), tally);
}

class RandomClusters : public testing::TestWithParam<ImpactLaw> {};

TEST_P(RandomClusters, PlanksOnTwoSupports) {
  ClusterTally tally;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    CheckContacts(seed, 0, {0, 1}, {2, 3}, seed % 3 != 0, GetParam(), &tally);
  }
  std::cout << tally << "\n";
  EXPECT_GT(tally.derivatives + tally.discontinuous, 20);
}

TEST_P(RandomClusters, ThreeAndFourContacts) {
  ClusterTally tally;
  const std::vector<std::pair<ConstraintSet, ConstraintSet>> sets = {
      {{0}, {1, 2}}, {{}, {0, 1, 2}}, {{0, 1}, {2, 3}}, {{0}, {1, 2, 3}}, {{0, 1, 2}, {3}}};
  for (unsigned seed = 1; seed <= 80; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const auto& [resting, hit] = sets[seed % sets.size()];
    CheckContacts(seed, seed % 2 == 0 ? 1 : 3, resting, hit, seed % 3 != 0, GetParam(), &tally);
  }
  std::cout << tally << "\n";
  EXPECT_GT(tally.derivatives, 10);
  EXPECT_GT(tally.discontinuous, 5);
}

/// Refused as discontinuous before, though both orders are listed with the same outcome.
TEST_P(RandomClusters, WhoseOrdersAgreeThoughPairsAreCoupled) {
  ClusterTally tally;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    CheckContacts(seed, 2, {0}, {1, 2}, seed % 2 != 0, GetParam(), &tally);
  }
  std::cout << tally << "\n";
  EXPECT_GT(tally.orders_agree, 10);
}

INSTANTIATE_TEST_SUITE_P(Laws, RandomClusters, testing::ValuesIn(kImpactLaws),
                         [](const testing::TestParamInfo<ImpactLaw>& info) {
                           return info.param == ImpactLaw::kProjection ? "Projection"
                                                                       : "Complementarity";
                         });

/// Two balls fall on a plank that rests on two supports: it rocks to the side of the ball that
/// lands first, ±0.218 rad/s at the horizon, and stays for both. The pair of the supports, both at
/// rest, is coupled with G > 0.
TEST(Plank, IsDiscontinuous) {
  const auto system = LoadRobot(std::string(CONTACT_FLOW_TEST_DATA) + "/plank.yaml");
  const NominalRun& nominal = system->nominal();
  const Trajectory run = Simulate(*system, nominal.x, nominal.u, nominal.duration);
  ASSERT_EQ(1u, run.transitions.size());
  const BDerivative B = DifferentiateOutcome(*system, run);
  EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome);
  EXPECT_NE(std::string::npos, B.status.message.find("_support'")) << B.status.message;
  // What is refused cannot be asked.
  const Vector w = Vector::Unit(2 * system->dof(), 0);
  EXPECT_THROW(B(w), std::domain_error);
  EXPECT_THROW(B.Error(w), std::domain_error);
  EXPECT_THROW(B.PerturbedModes(w), std::domain_error);
  EXPECT_EQ(ContactClass::kOrderDependent, AssessTransitions(*system, run)[0].contact_class);
  const std::vector<OrderOutcome>& outcomes = B.events.back().outcomes();
  ASSERT_FALSE(outcomes.empty());
  // The tilt rate is coordinate 2; a left ball first turns it the other way than a right one.
  double least = 0, most = 0;
  for (const OrderOutcome& outcome : outcomes) {
    least = std::min(least, outcome.v_plus(2));
    most = std::max(most, outcome.v_plus(2));
  }
  EXPECT_LT(least, -0.1);
  EXPECT_GT(most, 0.1);
}

}  // namespace
}  // namespace contact_flow
