// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity where the input changes what contacts with friction do: one lets go, or
// begins to slip. Beside a block's closed forms, and beside the size at which runs change their
// words, found by bisection.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/tips.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace test {

/// Two tips, an input that pushes the first along and one that lifts it; the spring between them
/// lifts, too.
struct LiftedTips : Tips<2> {
  static constexpr const char* kName = "lifted_tips";
  static constexpr int kInputs = 2;
  static constexpr std::array<const char*, 2> kInputNames = {"push", "lift"};
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Positions<S>& q, const Positions<S>& v,
                    const Eigen::Matrix<S, 2, 1>& u, Positions<S>* f) {
    Tips<2>::Force(p, q, v, Eigen::Matrix<S, 0, 1>(), f);
    const S pull = p.stiffness * (q(2) - q(0));
    (*f)(0) += u(0);
    (*f)(1) += u(1) + 0.5 * pull;
    (*f)(2) += 0.4 * u(0) - 0.3 * u(1);
    (*f)(3) += 0.5 * u(1) - 0.2 * u(0) - 0.7 * pull;
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

using test::Entries;
using test::Tight;

using Limit = ValidityRadius::Limit;

constexpr double kChange = 0.2, kEnd = 0.25;

ValidityRadius RadiusOf(const MechanicalSystem& system, const Trajectory& run, const Vector& w,
                        const std::vector<std::string>& parameters = {}) {
  BDerivativeOptions options;
  options.variables = {true, ParameterIndices(system.description(), parameters)};
  const BDerivative B = DifferentiateOutcome(system, run, options);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  return ValidityEstimator(system, run, B)(w);
}

/// The first tip alone, M = [[1, c], [c, 1]] of it, pressed by 9 N; the second one is far above.
class OneTip {
 public:
  OneTip(double mu, double coupling) {
    ParameterValues values = {{"mu0", mu}, {"f1", -9.0}};
    values["m1"] = values["m4"] = coupling;
    system_ = MakeSystem<test::LiftedTips>(values);
  }
  const MechanicalSystem& system() const { return *system_; }
  Trajectory Run(const Vector& first, const Vector& second, double speed = 0) const {
    const Vector x = Entries({0, 0, 5, 5, speed, 0, 0, 0});
    return Simulate(*system_, x, {{0, kChange}, {first, second}}, kEnd, Tight());
  }

 private:
  std::unique_ptr<MechanicalSystem> system_;
};

/// It sticks, and is lifted by 9 N + ε, beside a push of 0.1 N; or slips.
TEST(FrictionRadiusAtInputs, OfATipThatANewInputLifts) {
  for (const double speed : {0.0, 2.0}) {
    const OneTip tip(0.5, 0);
    for (const double over : {1e-1, 1e-3, 1e-5, 1e-7}) {
      const Trajectory run = tip.Run(Entries({0.1, 0}), Entries({0.1, 9 + over}), speed);
      ASSERT_TRUE(run.arcs.back().mode.Empty());
      const ValidityRadius found = RadiusOf(tip.system(), run, -Vector::Unit(10, 9));
      EXPECT_NEAR(over, found.radius, 1e-6 * over) << Describe(tip.system().description(), found);
      // What it rises by until the end vanishes with it.
      EXPECT_TRUE(found.limit == Limit::kReleaseRate || found.limit == Limit::kHorizon);
      // By what presses it, too.
      Vector w = Vector::Zero(11);
      w(10) = -1;
      EXPECT_NEAR(over, RadiusOf(tip.system(), run, w, {"f1"}).radius, 1e-6 * over);
    }
  }
}

/// It sticks, and begins to slip by a push of 4.5 N + ε = μ 9 N + ε.
TEST(FrictionRadiusAtInputs, OfATipThatANewInputPushesAlong) {
  const OneTip tip(0.5, 0);
  for (const double over : {1e-1, 1e-3, 1e-5, 1e-7}) {
    const Trajectory run = tip.Run(Entries({0, 0}), Entries({4.5 + over, 0}));
    ASSERT_EQ("+o", run.arcs.back().mode.Word(2));
    const ValidityRadius found = RadiusOf(tip.system(), run, -Vector::Unit(10, 8));
    EXPECT_NEAR(over, found.radius, 1e-6 * over) << Describe(tip.system().description(), found);
    // What it slips until the end vanishes with it.
    EXPECT_TRUE(found.limit == Limit::kSlipRate || found.limit == Limit::kHorizon);
    Vector w = Vector::Zero(11);
    w(10) = 1;
    EXPECT_NEAR(over / 9, RadiusOf(tip.system(), run, w, {"mu0"}).radius, 1e-6 * over);
    // One that it holds is the other side of this.
    const Trajectory held = tip.Run(Entries({0, 0}), Entries({4.5 - over, 0}));
    ASSERT_EQ("so", held.arcs.back().mode.Word(2));
    const ValidityRadius cone = RadiusOf(tip.system(), held, Vector::Unit(10, 8));
    EXPECT_NEAR(over, cone.radius, 1e-6 * over) << Describe(tip.system().description(), cone);
    EXPECT_EQ(Limit::kCone, cone.limit);
  }
}

/// It never slips: with (ẍ, z̈) = 0 its forces are −push and 9 N − lift. Free, it leaves with an
/// acceleration by both, and M: it is held until it would have to be pulled.
TEST(FrictionRadiusAtInputs, OfATipThatNeverSlips) {
  const OneTip tip(-1, -0.4);
  for (const double over : {1e-1, 1e-3, 1e-5}) {
    const Trajectory run = tip.Run(Entries({1, 0}), Entries({1, 9 + over}));
    ASSERT_TRUE(run.arcs.back().mode.Empty());
    const ValidityRadius found = RadiusOf(tip.system(), run, -Vector::Unit(10, 9));
    EXPECT_NEAR(over, found.radius, 1e-6 * over) << Describe(tip.system().description(), found);
    const Trajectory on = tip.Run(Entries({1, 0}), Entries({1, 9 - over}));
    EXPECT_EQ("so", on.arcs.back().mode.Word(2));
  }
}

/// Near the first size at which the words along a direction change the radius is what is left.
TEST(FrictionRadiusAtInputs, IsTheDistanceToTheFirstChangeOfRandomRuns) {
  int found = 0;
  std::map<std::string, int> limits;
  for (unsigned seed = 1; seed <= 16; ++seed) {
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
    }
    const auto system = MakeSystem<test::LiftedTips>(values);
    const Vector x = Entries({0, 0, 0.2, seed % 3 == 0 ? 0.3 : 0, 0, 0, 0, 0});
    const double change = 0.1 + 0.1 * uniform(random), end = change + 0.05 + 0.1 * uniform(random);
    const Vector before = Entries({2 * normal(random), 2 * normal(random)});
    const Vector after = Entries({2 * normal(random), 2 * normal(random) + 12 * uniform(random)});
    const auto run = [&](const Vector& w) {
      const InputSchedule inputs{{0, change}, {before + w.tail(2), after + w.tail(2)}};
      return Simulate(*system, system->Perturb(x, w.head(8)), inputs, end, Tight());
    };
    const auto modes = [&](const Vector& w) -> std::vector<ContactMode> {
      try {
        const Trajectory moved = run(w);
        if (moved.status.ok()) return moved.ModeSequence();
      } catch (const std::invalid_argument&) {  // several motions fit from the start on
      }
      return {};
    };
    for (const int entry : {0, 2, 8, 9}) {
      for (const double sign : {1.0, -1.0}) {
        const Vector w = sign * Vector::Unit(10, entry);
        const std::vector<ContactMode> base = modes(2e-3 * w);
        double low = 2e-3, high = 0;
        for (double alpha = low; alpha < 3 && high == 0 && !base.empty(); alpha *= 1.2) {
          (modes(alpha * w) == base ? low : high) = alpha;
        }
        if (high == 0) continue;
        while (high - low > 1e-12) {
          const double middle = (low + high) / 2;
          (modes(middle * w) == base ? low : high) = middle;
        }
        // Closer by, words are told by tolerances.
        for (const double left : {1e-3, 1e-4}) {
          const ValidityRadius radius = RadiusOf(*system, run((1 - left) * low * w), w);
          const std::string told = std::to_string(seed) + " along " + std::to_string(entry) + ": " +
                                   Describe(system->description(), radius);
          EXPECT_GT(radius.radius, 0.2 * left * low) << told;
          EXPECT_LT(radius.radius, 2 * left * low) << told;
          ++found;
          ++limits[LimitName(radius.limit)];
        }
      }
    }
  }
  EXPECT_GT(found, 80);
  EXPECT_GT(limits["release rate"], 5);
  for (const auto& [limit, count] : limits) RecordProperty(limit, count);
}

}  // namespace
}  // namespace contact_flow
