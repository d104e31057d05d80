// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity where new forces lift a contact that was pressed: at a change of the
// input, and behind the impact of another. Beside closed forms, and beside the size at which runs
// change their modes, found by bisection.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::Entries;
using test::kGravity;
using test::Tight;

using Limit = ValidityRadius::Limit;

/// A foot on a floor, lifted by the input and by a spring and a damper to a body above it:
///   z̈ = u − g + k (y − z − 1) + c (ẏ − ż),   ÿ = −g − k (y − z − 1) − c (ẏ − ż);   z, y − h ≥ 0.
struct SprungFoot : test::UnitMasses<2, 2> {
  static constexpr const char* kName = "sprung_foot";
  static constexpr int kInputs = 1;
  static constexpr std::array<const char*, 1> kInputNames = {"lift"};
  static constexpr std::array<const char*, 2> kCoordinates = {"z", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "stop"};
  template <class P>
  struct Parameters {
    P stiffness = 0, damping = 0, stop = -10;
    template <class V>
    void Visit(V&& visit) {
      visit(stiffness, "stiffness", "N/m", "k", Range::kAny);
      visit(damping, "damping", "N s/m", "c", Range::kAny);
      visit(stop, "stop", "m", "h", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>& v, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 2, 1>* f) {
    const S pull = p.stiffness * (q(1) - q(0) - 1.0) + p.damping * (v(1) - v(0));
    (*f)(0) = u(0) - kGravity + pull;
    (*f)(1) = -kGravity - pull;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(0);
    (*a)(1) = q(1) - p.stop;
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Entries({0, 1, 0, 0});
    run.u = Vector::Zero(1);
    return run;
  }
};

ValidityRadius Radius(const MechanicalSystem& system, const Trajectory& run, const Vector& w,
                      const std::vector<std::string>& parameters = {}) {
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  options.variables = {true, ParameterIndices(system.description(), parameters)};
  const BDerivative B = DifferentiateOutcome(system, run, options);
  EXPECT_TRUE(B.status.ok()) << B.status.message;
  return ValidityEstimator(system, run, B)(w);
}

/// While the foot rests y = e + (y₀ − e) cos ωt + ẏ₀/ω sin ωt, e = 1 − g/k, ω² = k. From t_k on the
/// foot leaves with z̈ = ε, if u₁ = ε + g − k (y(t_k) − 1): this falls by k cos ωt_k with y₀, by
/// k/ω sin ωt_k with ẏ₀, and by 1 with u.
TEST(RadiusAtInputs, OfAFootThatANewInputLifts) {
  const double k = 40, omega = std::sqrt(k), change = 0.1;
  const auto foot = test::Make<SprungFoot>({{"stiffness", k}});
  const double y = 1 - kGravity / k - 0.2 * std::cos(omega * change);
  for (const double lift : {1.0, 1e-2, 1e-4, 1e-6, 1e-8}) {
    const Vector x = Entries({0, 1 - kGravity / k - 0.2, 0, 0});
    const Vector u = Vector::Constant(1, lift + kGravity - k * (y - 1));
    const auto run = [&](double dy, double du) {
      const InputSchedule inputs{{0, change}, {Vector::Constant(1, du), u + Entries({du})}};
      return Simulate(foot, x + Entries({0, dy, 0, 0}), inputs, change + 0.02, Tight());
    };
    const Trajectory base = run(0, 0);
    ASSERT_TRUE(base.arcs[1].mode.Empty());
    const struct {
      int entry;
      double slope;
    } directions[] = {
        {1, k * std::cos(omega * change)}, {3, k / omega * std::sin(omega * change)}, {4, 1}};
    for (const auto& along : directions) {
      const ValidityRadius found = Radius(foot, base, -Vector::Unit(5, along.entry));
      const double exact = lift / along.slope;
      EXPECT_NEAR(exact, found.radius, 1e-6 * exact + 1e-11)
          << lift << " along " << along.entry << ": " << Describe(foot.description(), found);
      EXPECT_EQ(Limit::kReleaseRate, found.limit);
      EXPECT_EQ(0, found.constraint);
      EXPECT_EQ(change, found.t);
    }
    // It is where runs change.
    const double last = lift / k / std::cos(omega * change);
    EXPECT_TRUE(run(-0.99 * last, 0).arcs[1].mode.Empty());
    EXPECT_FALSE(run(-1.01 * last - 1e-10, 0).arcs[1].mode.Empty());
    EXPECT_FALSE(run(0, -1.01 * lift - 1e-10).arcs[1].mode.Empty());
  }
}

/// One that the new input presses less has its force for a margin, as before.
TEST(RadiusAtInputs, IsNotShortWhereTheFootGoesOnResting) {
  const double k = 40;
  const auto foot = test::Make<SprungFoot>({{"stiffness", k}});
  const Vector x = Entries({0, 1 - kGravity / k, 0, 0});  // the body hangs still
  const InputSchedule inputs{{0, 0.1}, {Vector::Zero(1), Vector::Ones(1)}};
  const Trajectory run = Simulate(foot, x, inputs, 0.2, Tight());
  ASSERT_EQ(1, run.arcs.back().mode.Size());
  // The floor bears 2 g − 1 N.
  const ValidityRadius found = Radius(foot, run, Vector::Unit(5, 4));
  EXPECT_NEAR(2 * kGravity - 1, found.radius, 1e-9);
  EXPECT_EQ(Limit::kForce, found.limit);
}

/// A body that falls presses the foot down by its damper, until it meets its stop: then the foot
/// leaves with z̈ = u − g = ε.
TEST(RadiusAtInputs, OfAFootThatTheImpactOfAnotherSetsFree) {
  const auto foot = test::Make<SprungFoot>({{"damping", 1}, {"stop", 0.9}});
  for (const double lift : {1e-1, 1e-3, 1e-5}) {
    const Vector u = Vector::Constant(1, kGravity + lift);
    const Trajectory run = Simulate(foot, Entries({0, 1, 0, -1}), u, 0.12, Tight());
    ASSERT_EQ(2u, run.arcs.size());
    ASSERT_FALSE(run.arcs.back().mode.Contains(0));
    const ValidityRadius found = Radius(foot, run, -Vector::Unit(5, 4));
    EXPECT_NEAR(lift, found.radius, 1e-6 * lift) << Describe(foot.description(), found);
    EXPECT_EQ(Limit::kReleaseRate, found.limit);
  }
}

/// Three heights over floors, coupled by inertia and springs, and two inputs that lift them.
struct LiftedHeights : test::UnitMasses<3, 3> {
  static constexpr const char* kName = "lifted_heights";
  static constexpr int kInputs = 2;
  static constexpr std::array<const char*, 2> kInputNames = {"f", "g"};
  static constexpr std::array<const char*, 3> kCoordinates = {"z1", "z2", "z3"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"first", "second", "third"};
  template <class P>
  struct Parameters {
    P coupling = 0, stiffness = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(coupling, "coupling", "kg", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                         Eigen::Matrix<S, 3, 3>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(0, 1) = (*M)(1, 0) = S(p.coupling);
    (*M)(1, 2) = (*M)(2, 1) = S(-0.5 * p.coupling);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 2, 1>& u,
                    Eigen::Matrix<S, 3, 1>* f) {
    const S first = p.stiffness * (q(1) - q(0)), second = p.stiffness * (q(2) - q(1));
    (*f)(0) = -9.0 + first + u(0);
    (*f)(1) = -8.0 - first + second + 0.4 * u(1);
    (*f)(2) = -7.0 - second + u(1) - 0.3 * u(0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 3, 1>* a) {
    for (int i = 0; i < 3; ++i) (*a)(i) = q(i);
  }
  template <class P>
  static NominalRun Nominal(const P&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(2);
    return run;
  }
};

/// Near the first size at which the modes along a direction change the radius is what is left.
TEST(RadiusAtInputs, IsTheDistanceToTheFirstChangeOfRandomRuns) {
  int found = 0, releases = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto system = test::Make<LiftedHeights>(
        {{"coupling", 0.2 * normal(random)}, {"stiffness", 200 * uniform(random)}});
    Vector x = Vector::Zero(6);
    x(static_cast<int>(seed % 3)) = 0.4 + 0.3 * uniform(random);
    const double change = 0.1 + 0.05 * uniform(random);
    const Vector before = Entries({normal(random), normal(random)});
    const Vector after = Entries({15 * uniform(random), 15 * uniform(random)});
    const auto run = [&](const Vector& w) {
      const InputSchedule inputs{{0, change}, {before + w.tail(2), after + w.tail(2)}};
      return Simulate(system, x + w.head(6), inputs, change + 0.15, Tight());
    };
    for (int entry = 0; entry < 8; ++entry) {
      if (entry < 6 && static_cast<unsigned>(entry % 3) != seed % 3) continue;  // it rests
      const Vector w = (seed % 2 == 0 ? 1 : -1) * Vector::Unit(8, entry);
      const auto modes = [&](double alpha) -> std::vector<ContactMode> {
        try {
          return run(alpha * w).ModeSequence();
        } catch (const std::invalid_argument&) {  // below its floor
          return {};
        }
      };
      const std::vector<ContactMode> base = modes(1e-3);
      double low = 1e-3, high = 0;
      for (double alpha = low; alpha < 3 && high == 0; alpha *= 1.3) {
        (modes(alpha) == base ? low : high) = alpha;
      }
      if (high == 0) continue;
      while (high - low > 1e-12) {
        const double middle = (low + high) / 2;
        (modes(middle) == base ? low : high) = middle;
      }
      for (const double left : {1e-3, 1e-5}) {
        const Trajectory near = run((low - left * low) * w);
        BDerivativeOptions options;
        options.variables.inputs = true;
        const BDerivative B = DifferentiateOutcome(system, near, options);
        if (!B.status.ok()) continue;  // it touches as it ends
        const ValidityRadius radius = ValidityEstimator(system, near, B)(w);
        EXPECT_GT(radius.radius, 0.2 * left * low) << seed << " along " << entry;
        EXPECT_LT(radius.radius, 1.5 * left * low)
            << seed << " along " << entry << ": " << Describe(system.description(), radius);
        ++found;
        releases += radius.limit == Limit::kReleaseRate;
      }
    }
  }
  EXPECT_GT(found, 60);
  EXPECT_GT(releases, 4);
  RecordProperty("found", found);
  RecordProperty("releases", releases);
}

}  // namespace
}  // namespace contact_flow
