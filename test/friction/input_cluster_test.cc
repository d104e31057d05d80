// SPDX-License-Identifier: BSD-3-Clause
// Changes of the input at the instants of events with friction: derivatives by state, inputs and
// instants beside one-sided quotients of other runs, and a block's closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace test {

/// Two tips, and two inputs that push both of them.
struct PushedTips : Tips<2> {
  static constexpr const char* kName = "pushed_tips";
  static constexpr int kInputs = 2;
  static constexpr std::array<const char*, 2> kInputNames = {"f", "g"};
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Positions<S>& q, const Positions<S>& v,
                    const Eigen::Matrix<S, 2, 1>& u, Positions<S>* f) {
    Tips<2>::Force(p, q, v, Eigen::Matrix<S, 0, 1>(), f);
    (*f)(0) += u(0);
    (*f)(1) += u(1);
    (*f)(2) += 0.4 * u(0) - 0.3 * u(1);
    (*f)(3) += 0.5 * u(1) - 0.2 * u(0);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run = Tips<2>::Nominal(p);
    run.u = Vector::Zero(2);
    return run;
  }
};

}  // namespace test

namespace {

using test::Tight;

SimulateOptions WithSimultaneity(double simultaneity) {
  SimulateOptions options = Tight();
  options.simultaneity_tolerance = simultaneity;
  return options;
}

/// CONTACT_FLOW_INPUT_CASES: how many.
int NumCases() {
  const char* text = std::getenv("CONTACT_FLOW_INPUT_CASES");
  return text != nullptr ? std::atoi(text) : 120;
}

/// A block on a level floor, m = 1, g = 10, μ = ½, stops from 2 m/s at t_s = 0.4 s, where a push f
/// begins. With δ = v(t_s) > 0 of a run that is late, and a₊ = f − 5, a₋ = f + 5 the accelerations
/// of slips forward and back, the velocity at T is, to first order,
///   f > 5:       max(δ, 0) + a₊ (T − t_k),       |f| < 5:  0,
///   f < −5:      a₋ (T − t_k + max(δ, 0)/a₊).
TEST(FrictionalInputCluster, BlockThatIsPushedWhereItStops) {
  const auto block = MakeModel("block_on_incline",
                               {{"incline", 0}, {"gravity", 10}, {"friction", 0.5}, {"mass", 1}});
  constexpr double kStop = 0.4, kEnd = 0.9;
  Vector x = Vector::Zero(6);
  x(3) = 2;
  x(5) = 1;  // the clock
  for (const double push : {8.0, 3.0, -3.0, -7.0}) {
    const Vector none = Vector::Zero(1), f = Vector::Constant(1, push);
    const Trajectory run = Simulate(*block, x, {{0, kStop}, {none, f}}, kEnd, Tight());
    ASSERT_TRUE(run.status.ok()) << run.status.message;
    const GridDerivative B(*block, run);
    ASSERT_TRUE(B.status().ok()) << push << ": " << B.status().message;
    const double forward = push - 5, back = push + 5;
    for (const double faster : {1.0, -1.0}) {
      for (const double later : {0.0, 0.3, -0.3}) {
        Vector dx = Vector::Zero(6);
        dx(3) = faster;
        const Matrix du = Matrix::Zero(1, 2);
        const double delta = std::max(faster - 5 * later, 0.0);
        const double expected = push > 5    ? delta - forward * later
                                : push < -5 ? back * (delta / forward - later)
                                            : 0;
        EXPECT_NEAR(expected, B(dx, du, Vector::Constant(1, later))(3), 1e-10)
            << push << ", " << faster << ", " << later;
      }
    }
    // δ and what stops: two orders.
    std::set<std::vector<std::string>> orders;
    for (const EventMap& event : B.intervals().front().derivative.events) {
      if (event.absorbed() || event.num_input_changes() == 0) continue;
      const PiecewiseLinearMap map = event.Pieces(7);
      for (const LinearPiece& piece : map.pieces()) {
        ASSERT_EQ(1u, piece.omega.size());
        orders.insert(piece.omega.front());
      }
    }
    EXPECT_TRUE(orders.count({"floor", "input change"})) << push;
    EXPECT_GE(orders.size(), 2u) << push;
  }
}

/// A run, and an input that changes at one of its events, once or twice.
struct Case {
  static constexpr double kDuration = 0.6;
  std::unique_ptr<MechanicalSystem> system;
  Vector x;
  InputSchedule schedule;
  bool coincides = false;
};

Case DrawCase(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  Matrix S(4, 4);
  for (double& entry : S.reshaped()) entry = 0.25 * normal(random);
  const Matrix mass = Matrix::Identity(4, 4) + S * S.transpose();
  ParameterValues values;
  for (int i = 0; i < 16; ++i) values["m" + std::to_string(i)] = mass(i / 4, i % 4);
  for (int i = 0; i < 4; ++i) {
    values["f" + std::to_string(i)] = (i % 2 == 0 ? 1 : -9) + normal(random);
  }
  values["stiffness"] = 20 * uniform(random);
  values["damping"] = uniform(random);
  for (int i = 0; i < 2; ++i) {
    values["mu" + std::to_string(i)] = uniform(random) < 0.15 ? -1 : 0.1 + 0.8 * uniform(random);
    values["gamma" + std::to_string(i)] = uniform(random) < 0.7 ? 0 : uniform(random);
  }
  Case c;
  c.system = MakeSystem<test::PushedTips>(values);
  c.x.resize(8);
  c.x << 0, 0.02 + 0.1 * uniform(random), 0.2, 0.02 + 0.1 * uniform(random), 1.5 * normal(random),
      -uniform(random), 1.5 * normal(random), -uniform(random);
  const auto input = [&] { return Vector::NullaryExpr(2, [&] { return 3 * normal(random); }); };
  c.schedule = {{0}, {input()}};
  const Trajectory run = Simulate(*c.system, c.x, c.schedule, Case::kDuration, Tight());
  if (!run.status.ok() || run.transitions.empty()) return c;
  const Transition& event = run.transitions[random() % run.transitions.size()];
  if (event.t < 0.02 || event.t > Case::kDuration - 0.02) return c;
  c.schedule.grid.push_back(event.t);
  c.schedule.values.push_back(input());
  if (seed % 3 == 0) {
    c.schedule.grid.push_back(event.t + 1e-11);
    c.schedule.values.push_back(input());
  }
  c.coincides = true;
  return c;
}

Vector Moved(const Case& c, const Vector& dx, const Matrix& du, const Vector& dt, double alpha) {
  InputSchedule schedule = c.schedule;
  for (std::size_t k = 0; k < schedule.grid.size(); ++k) {
    schedule.values[k] += alpha * du.col(static_cast<Eigen::Index>(k));
    if (k > 0) schedule.grid[k] += alpha * dt(static_cast<Eigen::Index>(k) - 1);
  }
  const Trajectory run = Simulate(*c.system, c.x + alpha * dx, schedule, Case::kDuration, Tight());
  return run.status.ok() ? run.FinalState() : Vector();
}

TEST(FrictionalInputCluster, DerivativesAreTheLimitsOfQuotients) {
  int answered = 0, with_cluster = 0, runs = 0;
  std::map<std::string, int> refused;
  for (int seed = 1; seed <= NumCases(); ++seed) {
    const Case c = DrawCase(static_cast<unsigned>(seed));
    if (!c.coincides) continue;
    const Trajectory run =
        Simulate(*c.system, c.x, c.schedule, Case::kDuration, WithSimultaneity(1e-9));
    if (!run.status.ok()) continue;
    ++runs;
    const GridDerivative B(*c.system, run);
    if (!B.status().ok()) {
      ++refused[B.status().message.substr(B.status().message.find(" s ") + 3, 60)];
      continue;
    }
    for (const IntervalLinearization& interval : B.intervals()) {
      for (const EventMap& event : interval.derivative.events) {
        with_cluster += !event.absorbed() && event.num_input_changes() > 0;
      }
    }
    std::mt19937 random(static_cast<unsigned>(seed) + 1000);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int j = 0; j < 6; ++j) {
      const Vector dx = Vector::NullaryExpr(8, [&] { return uniform(random); });
      const auto K = static_cast<Eigen::Index>(c.schedule.grid.size());
      const Matrix du = Matrix::NullaryExpr(2, K, [&] { return uniform(random); });
      Vector dt = Vector::NullaryExpr(K - 1, [&] { return j % 2 * 0.1 * uniform(random); });
      std::sort(dt.begin(), dt.end());  // changes keep their order
      Vector exact;
      try {
        exact = B(dx, du, dt);
      } catch (const std::domain_error& reason) {
        ++refused["in a direction"];
        continue;
      }
      ++answered;
      const Vector base = run.FinalState();
      double best = 1e300;
      for (const double alpha : {1e-4, 1e-5, 1e-6, 1e-7}) {
        const Vector moved = Moved(c, dx, du, dt, alpha);
        if (moved.size() == 0) continue;
        best = std::min(best, ((moved - base) / alpha - exact).cwiseAbs().maxCoeff());
      }
      // The second order is α times curvatures of a few hundred, of a few thousand where impacts
      // follow each other quickly; noise 1e-12/α.
      EXPECT_LT(best, 2e-3 * (1 + exact.cwiseAbs().maxCoeff())) << "seed " << seed << ", " << j;
    }
  }
  std::printf("%d runs, %d with a cluster, %d directions answered\n", runs, with_cluster, answered);
  for (const auto& [why, count] : refused) std::printf("  %3d %s\n", count, why.c_str());
  EXPECT_GT(with_cluster, 2 * NumCases() / 5);
  EXPECT_GT(answered, 2 * NumCases());
}

}  // namespace
}  // namespace contact_flow
