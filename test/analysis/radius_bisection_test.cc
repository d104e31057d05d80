// SPDX-License-Identifier: BSD-3-Clause
// The radius of validity against the size at which the sequence of contact modes changes, found by
// bisection, along every unit direction of runs of several models.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/analysis/validity_radius.h"
#include "contact_flow/derivative/start_directions.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_library.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;

using Limit = ValidityRadius::Limit;
constexpr double kSmall = 2e-3;  // the sequence of a direction is that of this size
constexpr double kLarge = 1.5;   // changes are looked for up to here
constexpr int kSizes = 40;

/// The modes that a run passes through; none where it is refused or ends before.
std::vector<ContactMode> Modes(const MechanicalSystem& system, const Vector& x, double duration) {
  try {
    const Trajectory run = Simulate(system, x, system.nominal().u, duration, AtTolerance(1e-11));
    if (run.status.ok()) return run.ModeSequence();
  } catch (const std::invalid_argument&) {
  }
  return {};
}

struct Start {
  const char* model;
  bool behind_first_event;  // of the nominal run
  double tilt;              // of the third coordinate, for an order of touchdowns
  std::set<int> left_out;   // directions that lead to a singularity of the model, or of its gaps
};

class RadiusByBisection : public testing::TestWithParam<Start> {};

/// At the distance m from the first change the radius is m, to first order in m: exactly where a
/// guard passes zero. Where two vanish together (a release and the return after it, whose speed is
/// a power of the margin) the estimate from one of them is off by that power, at most 4.
TEST_P(RadiusByBisection, IsTheDistanceToTheFirstChange) {
  const auto system = MakeModel(GetParam().model);
  const NominalRun& nominal = system->nominal();
  Vector x = nominal.x;
  double duration = nominal.duration;
  if (GetParam().tilt != 0) {
    Vector w = Vector::Zero(2 * system->dof());
    w(2) = GetParam().tilt;
    x = system->Perturb(x, w);
  }
  if (GetParam().behind_first_event) {
    const Trajectory run = Simulate(*system, x, nominal.u, duration, AtTolerance(1e-11));
    x = run.transitions[0].x_plus;
    duration += 0.3 - run.transitions[0].t;
  }
  const StartDirections directions(*system, x, InitialMode(*system, x, nominal.u), StartCone());
  int found = 0, close = 0;
  std::map<Limit, int> limits;
  for (int k = 0; k < 4 * system->dof(); ++k) {
    if (GetParam().left_out.count(k) > 0) continue;
    const double sign = k % 2 == 0 ? 1 : -1;
    Vector w = directions.Project(sign * Vector::Unit(2 * system->dof(), k / 2));
    if (w.isZero(0)) continue;
    w /= w.cwiseAbs().maxCoeff();
    const auto modes = [&](double alpha) {
      return Modes(*system, system->Perturb(x, alpha * w), duration);
    };
    const std::vector<ContactMode> base = modes(kSmall);
    double low = kSmall, high = 0;
    for (int i = 1; i <= kSizes && high == 0 && !base.empty(); ++i) {
      const double alpha = kSmall * std::pow(kLarge / kSmall, i / (1.0 * kSizes));
      (modes(alpha) == base ? low : high) = alpha;
    }
    if (high == 0) continue;
    while (high - low > 1e-9) {
      const double middle = (low + high) / 2;
      (modes(middle) == base ? low : high) = middle;
    }
    const double margin = 1e-3 * high;
    const Vector near = system->Perturb(x, (high - margin) * w);
    const Trajectory run = Simulate(*system, near, nominal.u, duration, AtTolerance(1e-11));
    const BDerivative B = DifferentiateOutcome(*system, run);
    if (!B.status.ok()) continue;
    const ValidityRadius radius = ValidityEstimator(*system, run, B)(w);
    const double ratio = radius.radius / margin;
    EXPECT_GT(ratio, 0.2) << "direction " << k << " changes at " << high << ": "
                          << Describe(system->description(), radius);
    EXPECT_LT(ratio, 1.5) << "direction " << k << " changes at " << high << ": "
                          << Describe(system->description(), radius);
    ++found;
    close += std::abs(ratio - 1) < 0.1;
    ++limits[radius.limit];
  }
  EXPECT_GE(found, 1);
  EXPECT_GE(close, 0.6 * found);
  for (const auto& [limit, count] : limits) {
    RecordProperty(LimitName(limit), count);
  }
  RecordProperty("found", found);
  RecordProperty("close", close);
}

INSTANTIATE_TEST_SUITE_P(
    Runs, RadiusByBisection,
    testing::Values(Start{"soft_biped", false, 0, {}},
                    // Down far enough, the body passes through a foot, where its leg has no axis.
                    Start{"soft_biped", true, 0, {7}}, Start{"hopping_trot", false, 0, {}},
                    Start{"hopping_trot", true, 0, {}}, Start{"rigid_quadruped", false, 0, {}},
                    Start{"rigid_quadruped", false, 0.05, {}},
                    Start{"rigid_biped", false, 0.05, {}}));

/// Numbers from the first finding of this kind: forces that are least just behind a touchdown.
TEST(ValidityRadius, SeesForcesJustBehindATouchdown) {
  const auto system = MakeModel("soft_biped");
  const NominalRun& nominal = system->nominal();
  const Trajectory run =
      Simulate(*system, nominal.x, nominal.u, nominal.duration, AtTolerance(1e-11));
  const BDerivative B = DifferentiateOutcome(*system, run);
  const ValidityEstimator radius(*system, run, B);
  // λ = 1 N there, and falls by 4.836 N: by quotients of runs at 1e-4 and 1e-5.
  const ValidityRadius pitched = radius(Vector::Unit(14, 6));
  EXPECT_EQ(Limit::kForce, pitched.limit);
  EXPECT_NEAR(1 / 4.836, pitched.radius, 1e-4);
  EXPECT_NEAR(nominal.duration - 0.4, pitched.t, 1e-6);
  EXPECT_EQ(Limit::kForce, radius(-Vector::Unit(14, 3)).limit);
}

/// A block that slides from v₀ stops after v₀/k, k = g (μ cos φ − sin φ): pushed harder, it still
/// slides at the end of the run, and pushed less by v₀ it never slid.
TEST(ValidityRadius, OfABlockThatSlidesAndStops) {
  const double slope = 0.3, mu = 0.5, v0 = 2, duration = 1.5;
  const auto system = MakeModel("block_on_incline", {{"incline", slope}, {"friction", mu}});
  Vector x = Vector::Zero(6);
  x(3) = v0;
  x(5) = 1;
  const Trajectory run = Simulate(*system, x, Vector::Zero(1), duration, AtTolerance(1e-11));
  ASSERT_EQ(2u, run.arcs.size());
  const BDerivative B = DifferentiateOutcome(*system, run);
  const ValidityEstimator radius(*system, run, B);
  const double k = 9.81 * (mu * std::cos(slope) - std::sin(slope));
  const ValidityRadius faster = radius(Vector::Unit(6, 3));
  EXPECT_EQ(Limit::kHorizon, faster.limit);
  EXPECT_NEAR(duration * k - v0, faster.radius, 1e-9);
  const ValidityRadius slower = radius(-Vector::Unit(6, 3));
  EXPECT_NEAR(v0, slower.radius, 1e-9) << Describe(system->description(), slower);
  EXPECT_TRUE(std::isinf(radius(Vector::Unit(6, 0)).radius));
}

}  // namespace
}  // namespace contact_flow
