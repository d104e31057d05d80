// SPDX-License-Identifier: BSD-3-Clause
// Random clusters of coupled contacts, resting and hit: the verdict against one-sided quotients and
// against perturbed runs, under both impact laws.
#include "contact_flow/derivative/cluster_class.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <iostream>
#include <random>

#include "contact_flow/analysis/assumptions.h"
#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/model/robots.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

constexpr ImpactLaw kLaws[] = {ImpactLaw::kComplementarity, ImpactLaw::kProjection};

/// Four contacts on five coordinates, a_i = n_i·q, of which `kinds` says what the normals are; M is
/// diagonal, the last of its entries `mass`, the force constant. All coefficients from `seed`.
///   0  a plank on two supports (height, tilt, width 1), two balls above it, and a rod
///   1  random unit normals
///   2  contacts 1 and 2 are coupled with 0 only: G_12 = G_01 G_02 / G_00, so that they are
///      orthogonal as long as 0 holds
///   3  random, all G_ij ≤ 0
struct Contacts : test::UnitMasses<5, 4> {
  static constexpr const char* kName = "contacts";
  static constexpr std::array<const char*, 5> kCoordinates = {"q0", "q1", "q2", "q3", "q4"};
  static constexpr std::array<const char*, 5> kUnits = {"m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 4> kConstraintNames = {"c0", "c1", "c2", "c3"};
  template <class P>
  struct Parameters {
    P seed = 1, kind = 0, mass = 1, first = 0, second = 0, third = 0, fourth = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(seed, "seed", "", "of all coefficients", Range::kAny);
      visit(kind, "kind", "", "of the normals", Range::kAny);
      visit(mass, "mass", "kg", "of q4", Range::kAny);
      visit(first, "first", "", "restitution", Range::kUnitInterval);
      visit(second, "second", "", "restitution", Range::kUnitInterval);
      visit(third, "third", "", "restitution", Range::kUnitInterval);
      visit(fourth, "fourth", "", "restitution", Range::kUnitInterval);
    }
  };
  static double Number(double value) { return value; }
  template <class S, int N>
  static double Number(const Dual<S, N>& x) {
    return Number(x.value);
  }
  static Eigen::Matrix<double, 4, 5> Normals(double seed, int kind) {
    std::mt19937 generator(static_cast<unsigned>(seed));
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * (generator() / 4294967296.0);
    };
    Eigen::Matrix<double, 4, 5> n;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 5; ++j) n(i, j) = uniform(-1, 1);
      n.row(i).normalize();
    }
    if (kind == 0) {
      // q = (height, tilt / √12, ball, ball, rod) of a plank of unit mass.
      const double s = std::sqrt(12.0);
      const double left = uniform(-0.5, 0), right = uniform(0.05, 0.5);
      n << 1, -s * left, 0, 0, 0, 1, -s * right, 0, 0, 0,  //
          -1, s * uniform(-0.5, 0.5), 1, 0, 0, -1, s * uniform(-0.5, 0.5), 0, 1, 0;
    } else if (kind == 2) {
      n.setZero();
      n(0, 0) = 1;
      for (int i : {1, 2}) {
        const double angle = uniform(1.7, 2.6);
        n(i, 0) = std::cos(angle);
        n(i, i) = std::sin(angle);
      }
      n(3, 3) = 1;
    } else if (kind == 3) {
      // Cholesky factor of an M-matrix with unit diagonal.
      Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < i; ++j) G(i, j) = G(j, i) = -uniform(0, 0.3);
      }
      n.setZero();
      n.leftCols<4>() = Eigen::Matrix4d(G.llt().matrixL());
    }
    return n;
  }
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                         Eigen::Matrix<S, 5, 5>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(4, 4) = S(p.mass);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                    const Eigen::Matrix<S, 5, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 5, 1>* f) {
    // Presses onto all, ä_i = −2 where M = 1.
    const Eigen::Matrix<double, 4, 5> n = Normals(Number(p.seed), static_cast<int>(Number(p.kind)));
    const Eigen::Matrix<double, 5, 1> press =
        -2 * n.transpose() * (n * n.transpose()).ldlt().solve(Eigen::Vector4d::Ones());
    std::mt19937 generator(static_cast<unsigned>(Number(p.seed)) + 77);
    for (int i = 0; i < 5; ++i) {
      (*f)(i) = S(press(i));
      for (int j = 0; j < 5; ++j) {
        const double c = 0.6 * (generator() / 4294967296.0 - 0.5);
        (*f)(i) += c * v(j) - 0.3 * c * q(j);
      }
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                   Eigen::Matrix<S, 4, 1>* a) {
    const Eigen::Matrix<double, 4, 5> n = Normals(Number(p.seed), static_cast<int>(Number(p.kind)));
    for (int i = 0; i < 4; ++i) {
      (*a)(i) = S(0.0);
      for (int j = 0; j < 5; ++j) (*a)(i) += n(i, j) * q(j);
    }
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.first : i == 1 ? p.second : i == 2 ? p.third : p.fourth;
  }
};

constexpr double kFlight = 0.05, kAfter = 0.02;  // [s] before and after the cluster

/// A state from which motion in `mode` arrives at (0, v) after kFlight, by Heun steps backwards in
/// so small steps that the residual gaps (1e-12) stay within the simultaneity tolerance, 1e-9 s.
Vector Before(const MechanicalSystem& system, ContactMode mode, const Vector& v) {
  ContactDynamics dynamics(system, Vector(0));
  Vector x = Vector::Zero(2 * v.size());
  x.tail(v.size()) = v;
  constexpr int kSteps = 400;
  const double h = -kFlight / kSteps;
  for (int k = 0; k < kSteps; ++k) {
    const Vector k1 = dynamics.Field(x, mode), k2 = dynamics.Field(x + h / 2 * k1, mode),
                 k3 = dynamics.Field(x + h / 2 * k2, mode), k4 = dynamics.Field(x + h * k3, mode);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return x;
}

struct Tally {
  int derivatives = 0, orders_agree = 0, discontinuous = 0, unseen = 0, refused = 0, skipped = 0;
};
std::ostream& operator<<(std::ostream& out, const Tally& t) {
  return out << t.derivatives << " derivatives (" << t.orders_agree
             << " where the orders agree though pairs are coupled), " << t.discontinuous
             << " discontinuous (" << t.unseen << " not shown by the perturbed runs), " << t.refused
             << " refused, " << t.skipped << " skipped";
}

/// Differentiates the run from x and judges the answer.
void Judge(const MechanicalSystem& system, const Vector& x, double duration, ImpactLaw law,
           int impacts, Tally* tally) {
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
void CheckContacts(unsigned seed, int kind, ContactMode resting, ContactMode hit, bool plastic,
                   ImpactLaw law, Tally* tally) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto restitution = [&] { return plastic ? 0.0 : 0.2 + 0.6 * uniform(generator); };
  const double gamma[] = {restitution(), restitution(), restitution(), restitution()};
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
  Vector x = Before(system, resting, v);
  // … by starting 0.2 m above.
  Eigen::Vector4d lift = Eigen::Vector4d::Zero();
  for (int i = 0; i < 4; ++i) lift(i) = (resting | hit).Contains(i) ? 0 : 0.4;
  x.head(5) += n.transpose() * (n * n.transpose()).ldlt().solve(lift);
  Judge(system, x, kFlight + kAfter, law, hit.Size(), tally);
}

class RandomClusters : public testing::TestWithParam<ImpactLaw> {};

TEST_P(RandomClusters, PlanksOnTwoSupports) {
  Tally tally;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    CheckContacts(seed, 0, {0, 1}, {2, 3}, seed % 3 != 0, GetParam(), &tally);
  }
  std::cout << tally << "\n";
  EXPECT_GT(tally.derivatives + tally.discontinuous, 20);
}

TEST_P(RandomClusters, ThreeAndFourContacts) {
  Tally tally;
  const std::vector<std::pair<ContactMode, ContactMode>> sets = {
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
  Tally tally;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    CheckContacts(seed, 2, {0}, {1, 2}, seed % 2 != 0, GetParam(), &tally);
  }
  std::cout << tally << "\n";
  EXPECT_GT(tally.orders_agree, 10);
}

INSTANTIATE_TEST_SUITE_P(Laws, RandomClusters, testing::ValuesIn(kLaws),
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

/// Masses 1 and m; floor: a_0 = q_0 ≥ 0, slope: a_1 = q_1 + c q_0 ≥ 0. Normalized coupling c √m.
struct HeavyAndLight : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "heavy_and_light";
  static constexpr std::array<const char*, 2> kCoordinates = {"heavy", "light"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "slope"};
  template <class P>
  struct Parameters {
    P mass = 1, coupling = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(mass, "mass", "kg", "", Range::kAny);
      visit(coupling, "coupling", "", "", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                         Eigen::Matrix<S, 2, 2>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(1, 1) = S(p.mass);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(-1.0);
    (*f)(1) = S(p.mass * (p.coupling - 1.0));
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1) + p.coupling * q(0);
  }
};

/// Hit first, the slope is lifted with c times the speed of q_0 when the floor is hit; the floor by
/// c m times that of q_1. This is discontinuous where it is more than the error of the outcome, 1e3
/// tolerances, and reported as neglected where it is less, whatever the normalized coupling. The
/// projection law lifts nothing.
TEST(Coupling, IsJudgedByTheJumpOfTheOutcome) {
  for (double mass : {1e-8, 1e-4, 1.0, 1e4, 1e8}) {
    for (double coupling : {1e-14, 1e-10, 9e-7, 9e-3}) {
      if (coupling * std::max(1.0, mass) > 0.1) continue;  // not what the closed form is for
      for (ImpactLaw law : kLaws) {
        SCOPED_TRACE(testing::Message() << "mass " << mass << ", coupling " << coupling);
        const auto system = test::Make<HeavyAndLight>({{"mass", mass}, {"coupling", coupling}});
        Vector x = Vector::Zero(4);
        x << 0.1, 0.1 - 0.1 * coupling, -1, -1 + coupling;
        SimulateOptions options;
        options.relative_tolerance = options.absolute_tolerance = 1e-12;
        options.impact_law = law;
        const Trajectory run = Simulate(system, x, Vector(0), 0.15, options);
        ASSERT_TRUE(run.status.ok());
        ASSERT_EQ(2, run.transitions.front().activated.Size());
        const BDerivative B = DifferentiateOutcome(system, run);
        const double speed = std::sqrt(1.2);  // √(1 + 2·0.1) of both
        const double jump = coupling * std::max(1.0, mass) * speed;
        if (jump > 1e-8 && law == ImpactLaw::kComplementarity) {
          EXPECT_EQ(Outcome::kDiscontinuous, B.status.outcome) << B.status.message;
          if (B.status.ok()) continue;
          double apart = 0;
          for (const OrderOutcome& outcome : B.events.back().outcomes()) {
            const Vector difference = outcome.v_plus - run.transitions[0].x_plus.tail(2);
            apart = std::max(apart, difference.cwiseAbs().maxCoeff());
          }
          EXPECT_NEAR(jump, apart, 2e-2 * jump);  // O(c) and O(c² m)
        } else {
          EXPECT_TRUE(B.status.ok()) << B.status.message;
          if (!B.status.ok()) continue;
          if (law == ImpactLaw::kComplementarity && coupling * std::sqrt(mass) > 1e-13) {
            EXPECT_GE(B.neglected_jump.maxCoeff(), jump);
          }
          EXPECT_LE(B.neglected_jump.maxCoeff(), 10 * std::min(jump, 1e-8));
        }
      }
    }
  }
}

/// The run of a shipped biped on its rigid feet, with the bilateral law: the foot that landed first
/// is held where the other lands.
TEST(Projection, DerivativeOfThePlanarBiped) {
  const auto system = LoadRobot(RobotFile("planar_biped"));
  const NominalRun& nominal = system->nominal();
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-12;
  options.impact_law = ImpactLaw::kProjection;
  const double duration = 0.4;
  const Trajectory run = Simulate(*system, nominal.x, nominal.u, duration, options);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_FALSE(run.transitions.empty());
  const BDerivative B = DifferentiateOutcome(*system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  int compared = 0;
  for (int k = 0; k < 2 * system->dof(); ++k) {
    for (double sign : {1.0, -1.0}) {
      const Vector unit = sign * Vector::Unit(2 * system->dof(), k);
      const Vector w = ProjectAdmissible(*system, nominal.x, run.arcs.front().mode, unit);
      if ((w - unit).norm() > 1e-9) continue;
      const QuotientReport report = CompareWithQuotients(*system, nominal.x, nominal.u, duration, w,
                                                         B(w), {1e-4, 1e-5, 1e-6}, options);
      if (!report.samples.back().status.ok()) continue;
      ++compared;
      EXPECT_LE(report.samples.back().error,
                0.05 * report.samples.front().error + 1e-4 * (1 + B(w).cwiseAbs().maxCoeff()))
          << "direction " << k << ": " << report.samples.front().error;
    }
  }
  EXPECT_GT(compared, 4);
}

}  // namespace
}  // namespace contact_flow
