// SPDX-License-Identifier: BSD-3-Clause
// Contacts that open inside a cluster, are pushed and return, against an integration of their gaps
// that knows nothing of event maps, and against one-sided quotients.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <numeric>
#include <random>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/derivative/free_flight.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::BeforeFlight;

constexpr int kWalls = 5;

/// A point mass among orthogonal walls a_i = q_i, M = I, under f_i(v) = c_i + Σ b_ik v_k + Σ h_ikl
/// v_k v_l with coefficients from `seed`: what a contact feels jumps at the impacts of the others.
/// The first `resting` walls have the restitution `elastic`, the others none.
struct Walls : test::UnitMasses<kWalls, kWalls> {
  static constexpr const char* kName = "walls";
  static constexpr std::array<const char*, kWalls> kCoordinates = {"q0", "q1", "q2", "q3", "q4"};
  static constexpr std::array<const char*, kWalls> kUnits = {"m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, kWalls> kConstraintNames = {"w0", "w1", "w2", "w3",
                                                                       "w4"};
  template <class P>
  struct Parameters {
    P seed = 1, elastic = 0, resting = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(seed, "seed", "", "of all coefficients", Range::kAny);
      visit(elastic, "elastic", "", "restitution of those at rest", Range::kUnitInterval);
      visit(resting, "resting", "", "number of walls touched before", Range::kAny);
    }
  };
  static double Number(double value) { return value; }
  template <class S, int N>
  static double Number(const Dual<S, N>& x) {
    return Number(x.value);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, kWalls, 1>&,
                    const Eigen::Matrix<S, kWalls, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, kWalls, 1>* f) {
    std::minstd_rand generator(static_cast<unsigned>(Number(p.seed)) * 7919u + 1u);
    generator.discard(5);
    const auto draw = [&] { return 2.0 * generator() / std::minstd_rand::max() - 1; };
    for (int i = 0; i < kWalls; ++i) {
      S sum = S(1.5 * draw());
      for (int k = 0; k < kWalls; ++k) {
        sum += draw() * v(k);
        for (int l = 0; l <= k; ++l) sum += draw() * (v(k) * v(l));
      }
      (*f)(i) = sum;
    }
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, kWalls, 1>& q, Eigen::Matrix<S, kWalls, 1>* a) {
    for (int i = 0; i < kWalls; ++i) (*a)(i) = q(i);
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return Number(p.resting) > i ? p.elastic : 0.0 * p.elastic;
  }
};

/// The first `resting` walls are touched at rest, the next ones hit, down to w4; those that the
/// force pulls away at once are no start.
struct Cluster {
  std::unique_ptr<MechanicalSystem> system;
  Transition transition;
  Vector v;  // v⁻
  double elastic = 0;

  Vector Force(const Vector& velocity) const {
    Matrix mass;
    Vector force;
    system->Dynamics(Vector::Zero(kWalls), velocity, Vector(0), ContactMode(), &mass, &force);
    return force;
  }
};

Cluster Draw(unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  Cluster cluster;
  const int resting = static_cast<int>(seed % 3);
  cluster.elastic = seed % 4 == 3 ? 0.3 + 0.5 * uniform(generator) : 0;
  cluster.system = std::make_unique<ModelSystem<Walls>>(ParameterValues{
      {"seed", seed}, {"elastic", cluster.elastic}, {"resting", static_cast<double>(resting)}});
  cluster.v = Vector::Zero(kWalls);
  Transition& t = cluster.transition;
  for (int i = resting; i < kWalls; ++i) {
    cluster.v(i) = -0.3 - uniform(generator);
    t.activated.Insert(i);
  }
  const Vector before = cluster.Force(cluster.v), after = cluster.Force(Vector::Zero(kWalls));
  for (int i = 0; i < kWalls; ++i) {
    if (i < resting && before(i) < 0) t.mode_before.Insert(i);
    if (i < resting && before(i) > 0) t.activated = ConstraintSet();  // no such start
    if (after(i) < 0) t.mode_after.Insert(i);
  }
  t.x_minus = t.x_plus = Vector::Zero(2 * kWalls);
  t.x_minus.tail(kWalls) = cluster.v;
  return cluster;
}

/// One gap in α², exactly: it opens and falls under constant accelerations, stage by stage.
struct Gap {
  bool closed = true;
  double gap = 0, rate = 0;

  void Spend(double time, double acceleration, double restitution) {
    while (true) {
      if (closed) {
        if (acceleration <= 0) return;
        closed = false;
        gap = rate = 0;
      }
      const double discriminant = rate * rate - 2 * acceleration * gap;
      double hit = std::numeric_limits<double>::infinity();
      if (acceleration < 0) hit = (-rate - std::sqrt(discriminant)) / acceleration;
      if (acceleration >= 0 && rate < 0 && discriminant >= 0) {
        hit = 2 * gap / (-rate + std::sqrt(discriminant));
      }
      if (hit > time) {
        gap += time * (rate + acceleration * time / 2);
        rate += acceleration * time;
        return;
      }
      time -= hit;
      gap = 0;
      rate = -restitution * (rate + acceleration * hit);
      if (rate <= 1e-12) {
        closed = true;
        rate = 0;
        if (acceleration <= 0) return;
      }
    }
  }
};

/// B(0, …, δq of the hit walls, …), its velocity part.
Vector ByGaps(const Cluster& cluster, const Vector& dq) {
  std::vector<std::pair<double, int>> hits;
  for (int i : cluster.transition.activated) hits.emplace_back(-dq(i) / cluster.v(i), i);
  std::sort(hits.begin(), hits.end());
  std::map<int, Gap> gaps;
  for (int i : cluster.transition.mode_before) gaps[i] = {};
  Vector v = cluster.v;
  for (std::size_t k = 0; k < hits.size(); ++k) {
    const int hit = hits[k].second;
    v(hit) = 0;
    gaps[hit] = {};
    const bool last = k + 1 == hits.size();
    const Vector force = cluster.Force(v);
    for (auto& [i, gap] : gaps) {
      // After the last hit, all that falls has returned in the end, with whatever restitution.
      const double stage = last ? 1e6 : hits[k + 1].first - hits[k].first;
      const double restitution = cluster.transition.mode_before.Contains(i) ? cluster.elastic : 0;
      if (!last || force(i) < 0) gap.Spend(stage, force(i), restitution);
    }
  }
  const Vector after = cluster.Force(v);
  Vector dv = Vector::Zero(kWalls);
  for (int i = 0; i < kWalls; ++i) {
    if (cluster.transition.mode_after.Contains(i)) continue;
    // Leaves: a fall that hits before it turns is over, too.
    Gap gap = gaps.at(i);
    const double later = gap.rate < 0 && !gap.closed ? -gap.rate / after(i) : 0;
    const double restitution = cluster.transition.mode_before.Contains(i) ? cluster.elastic : 0;
    gap.Spend(later, after(i), restitution);
    dv(i) = gap.rate - after(i) * (hits.back().first + later);
  }
  return dv;
}

/// Three plastic walls hit at speed 1 under f = (1 + 2v₂ + 2v₁v₂, −1, −1): w0 is let go by its own
/// impact (ä = 1), pushed after that of w1 (ä = −1), and let go again after that of w2.
struct ThreeHits : test::UnitMasses<3, 3> {
  static constexpr const char* kName = "three_hits";
  static constexpr std::array<const char*, 3> kCoordinates = {"q0", "q1", "q2"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"w0", "w1", "w2"};
  template <class P, class S>
  static void Force(const P&, const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 3, 1>& v,
                    const Eigen::Matrix<S, 0, 1>&, Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = 1.0 + 2.0 * v(2) + 2.0 * v(1) * v(2);
    (*f)(1) = (*f)(2) = S(-1.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 3, 1>* a) {
    for (int i = 0; i < 3; ++i) (*a)(i) = q(i);
  }
};

TEST(Openings, OfThreeHitsByHand) {
  const auto system = test::Make<ThreeHits>();
  Transition hit;
  hit.x_minus = hit.x_plus = Vector::Zero(6);
  hit.x_minus.tail(3).setConstant(-1);
  hit.activated = ConstraintSet({0, 1, 2});
  hit.mode_after = ContactMode({1, 2});
  const EventMap map(std::make_shared<ContactDynamics>(system, Vector(0)), hit);
  ASSERT_TRUE(map.status().ok()) << map.status().message;
  // Delays (0, 1, s): at s the rate is 1 − (s − 1), the gap ½ + (s−1) − (s−1)²/2, zero at 2 + √2;
  // after that the wall is closed. δv_0 = rate − s; later ä = 1 keeps it open up to s = 3, where
  // the gap ½ just suffices for the rate −1, and beyond that another fall ends at rate zero after
  // t = −r − √(r² − 2g), so that δv_0 = −t − s.
  const auto by_hand = [](double s) {
    const double rate = 2 - s, gap = 0.5 + (s - 1) - (s - 1) * (s - 1) / 2;
    if (gap <= 0) return -s;
    if (s <= 3) return rate - s;
    return -s - (-rate - std::sqrt(rate * rate - 2 * gap));
  };
  for (double s : {1.5, 2.5, 2.999, 3.2, 3.4, 3.5, 6.0}) {
    Vector w = Vector::Zero(6);
    w(1) = 1;
    w(2) = s;
    EXPECT_NEAR(by_hand(s), map(w)(3), 1e-9) << s;
  }
  // No kink in s at 3: −4 from both sides, where −3 was given once.
  Vector w = Vector::Zero(6);
  w << 0, 1, 3, 0, 0, 0;
  EXPECT_NEAR(-4, map(w)(3), 1e-6);
  EXPECT_FALSE(map.PiecewiseLinear().ok());
  EXPECT_NE(std::string::npos, map.PiecewiseLinear().message.find("'w0'"));
  EXPECT_TRUE(map.PiecewiseLinear({1, 2, 0}).ok()) << "w0 comes last: it only leaves";
  EXPECT_THROW(map.Pieces(7), NotPiecewiseLinear);
  EXPECT_THROW(map.Selection({0, 1, 2}), NotPiecewiseLinear);
  EXPECT_FALSE(map.IsDifferentiable(1e-9));
}

TEST(Openings, FollowAnIntegrationOfTheGaps) {
  int nonlinear = 0, linear = 0, opened = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    const Cluster cluster = Draw(seed);
    if (cluster.transition.activated.Empty()) continue;
    SCOPED_TRACE("seed " + std::to_string(seed));
    const EventMap map(std::make_shared<ContactDynamics>(*cluster.system, Vector(0)),
                       cluster.transition);
    ASSERT_TRUE(map.status().ok()) << map.status().message;
    const bool is_linear = map.PiecewiseLinear().ok();
    (is_linear ? linear : nonlinear) += 1;
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    PiecewiseLinearMap pieces;
    if (is_linear) pieces = map.Pieces(5);
    for (int trial = 0; trial < 30; ++trial) {
      Vector w = Vector::Zero(2 * kWalls);
      for (int i : cluster.transition.activated) w(i) = normal(generator);
      const Vector dv = ByGaps(cluster, w.head(kWalls));
      const Vector B = map(w);
      // Rates are sums of products of forces up to 30 and times up to 30, bounces
      // followed to 1e-12.
      const double rounding = 1e-9 * (1 + dv.cwiseAbs().maxCoeff());
      ASSERT_LE((B.tail(kWalls) - dv).cwiseAbs().maxCoeff(), rounding)
          << "direction " << w.transpose() << "\nB  " << B.tail(kWalls).transpose() << "\ngaps "
          << dv.transpose();
      for (const PerturbedEvent& event : map.PerturbedEvents(w)) {
        opened += event.kind == PerturbedEvent::Kind::kClosing;
      }
      if (is_linear) {
        ASSERT_LE((pieces(w) - B).cwiseAbs().maxCoeff(), rounding);
      }
    }
  }
  std::cout << linear << " piecewise linear, " << nonlinear << " not, " << opened
            << " contacts returned\n";
  EXPECT_GT(linear, 20);
  EXPECT_GT(nonlinear, 20);
}

TEST(Openings, FollowOneSidedQuotients) {
  constexpr double kFlight = 0.1, kAfter = 0.05;
  int compared = 0, skipped = 0;
  for (unsigned seed = 3; seed <= 120; seed += 3) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cluster cluster = Draw(seed);
    const Vector x = BeforeFlight(*cluster.system, cluster.v, kFlight);
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = 1e-12;
    options.speed_tolerance = 1e-11;  // closings have speeds of the size of α
    if (x.head(kWalls).minCoeff() <= 1e-3) continue;
    const Trajectory run = Simulate(*cluster.system, x, Vector(0), kFlight + kAfter, options);
    if (!run.status.ok() || run.transitions.empty()) continue;
    if (run.transitions.front().activated.Size() != kWalls) continue;
    const BDerivative B = DifferentiateOutcome(*cluster.system, run);
    ASSERT_TRUE(B.status.ok()) << B.status.message;
    if (B.events.front().PiecewiseLinear().ok()) continue;
    std::mt19937 generator(seed);
    std::normal_distribution<double> normal;
    for (int trial = 0; trial < 4; ++trial) {
      Vector w(2 * kWalls);
      for (int i = 0; i < 2 * kWalls; ++i) w(i) = normal(generator);
      w.normalize();
      const Vector prediction = B(w);
      const QuotientReport report =
          CompareWithQuotients(*cluster.system, x, Vector(0), kFlight + kAfter, w, prediction,
                               {1e-4, 1e-5, 1e-6}, options);
      const bool ran = std::all_of(report.samples.begin(), report.samples.end(),
                                   [](const QuotientSample& s) { return s.status.ok(); });
      skipped += !ran;
      compared += ran;
      if (!ran) continue;
      // A wrong derivative is off by O(1) at every α, a right one by O(α).
      EXPECT_LE(report.samples[2].error,
                0.05 * report.samples[0].error + 1e-4 * (1 + prediction.cwiseAbs().maxCoeff()))
          << report.samples[0].error << " " << report.samples[1].error << " "
          << report.samples[2].error << ", direction " << w.transpose();
    }
  }
  std::cout << compared << " directions compared, " << skipped << " perturbed runs refused\n";
  EXPECT_GT(compared, 10);
}

}  // namespace
}  // namespace contact_flow
