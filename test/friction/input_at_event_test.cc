// SPDX-License-Identifier: BSD-3-Clause
// Changes of the input at, or within rounding of, the instants of events with friction: runs beside
// closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "contact_flow/derivative/grid_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/model/model_system.h"
#include "test/friction/systems/flat_box.h"
#include "test/friction/systems/lifted_mass.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::kGravity;

/// How far a change is from its event [s]: none, roundings, and more on both sides.
std::vector<double> Offsets(double at) {
  const double last = std::nextafter(at, 2 * at) - at;  // of its digits
  std::vector<double> offsets = {0};
  for (const double far : {last, 2 * last, 1e-15, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6}) {
    offsets.push_back(far);
    offsets.push_back(-far);
  }
  return offsets;
}

/// A box on two corners is pushed at the floor by F = r t, and begins to slip where F = μ m g, with
/// no acceleration at first: that is rounding, of either sign. There the push changes by u. With s
/// the time since then, it goes on as
///   u > 0:            m v = r s²/2 + u s,
///   −2 μ m g < u < 0: m v = r (s + u/r)²/2 from s = −u/r on,
///   u < −2 μ m g:     m v = r s²/2 + (u + 2 μ m g) s.
TEST(InputAtEvent, BoxThatHasJustBegunToSlip) {
  constexpr double kMass = 2, kRate = 20, kAfter = 0.3;
  for (const double mu : {0.3, 0.53}) {
    const double held = mu * kMass * kGravity, at = held / kRate;
    const auto box = MakeSystem<test::FlatBox>({{"mass", kMass},
                                                {"rate", kRate},
                                                {"friction", mu},
                                                {"arm", 0},
                                                {"width", 2},
                                                {"height", 0.2}});
    for (const double u : {4.0, -3.0, -2 * held - 5}) {
      const double s = u < 0 && u > -2 * held ? kAfter + u / kRate : kAfter;
      const double push = u > 0 ? u : u > -2 * held ? 0 : u + 2 * held;
      const double v = (0.5 * kRate * s * s + push * s) / kMass;
      for (const double tolerance : {1e-9, 1e-12}) {
        for (const double offset : Offsets(at)) {
          const InputSchedule schedule{{0, at + offset}, {Vector::Zero(1), Vector::Constant(1, u)}};
          const Trajectory run =
              Simulate(*box, box->nominal().x, schedule, at + kAfter, AtTolerance(tolerance));
          ASSERT_TRUE(run.status.ok())
              << mu << ", " << u << ", " << offset << ": " << run.status.message;
          // Some 1e-6 s later the slip has a speed, and ends first.
          const std::size_t most = offset < 1e-7 ? 3 : 4;
          EXPECT_LE(run.transitions.size(), most) << mu << ", " << u << ", " << offset;
          const double near = 1e-8 + 20 * std::abs(offset);  // accelerations are less
          EXPECT_NEAR(v, run.FinalState()(4), near) << mu << ", " << u << ", " << offset;
        }
      }
    }
  }
}

/// The same of a tall and narrow box, u = −2 μ m g − 5 N: pushed so, it would tip if it went on to
/// slip forward, however slowly. By u and by the instant of the change,
///   ∂v/∂u = s/m,      ∂v/∂t = −(u + 2 μ m g)/m.
TEST(InputAtEvent, TallBoxThatIsPushedBackAsItBeginsToSlip) {
  constexpr double kMass = 2, kRate = 20, kAfter = 0.3;
  for (const double mu : {0.41, 0.53}) {
    const double held = mu * kMass * kGravity, at = held / kRate, back = -5;
    const auto box =
        MakeSystem<test::FlatBox>({{"mass", kMass}, {"rate", kRate}, {"friction", mu}, {"arm", 0}});
    for (const double tolerance : {1e-9, 1e-12}) {
      for (const double offset : Offsets(at)) {
        if (offset > 1e-7) continue;  // it slips forward
        const InputSchedule schedule{{0, at + offset},
                                     {Vector::Zero(1), Vector::Constant(1, back - 2 * held)}};
        const Trajectory run =
            Simulate(*box, box->nominal().x, schedule, at + kAfter, AtTolerance(tolerance));
        ASSERT_TRUE(run.status.ok()) << mu << ", " << offset << ": " << run.status.message;
        EXPECT_LE(run.transitions.size(), 2u) << mu << ", " << offset;
        const GridDerivative B(*box, run);
        ASSERT_TRUE(B.status().ok()) << mu << ", " << offset << ": " << B.status().message;
        const Vector none = Vector::Zero(8);
        Matrix du(1, 2);
        du << 0, 1;
        EXPECT_NEAR(kAfter / kMass, B(none, du)(4), 1e-6) << mu << ", " << offset;
        for (const double later : {1.0, -1.0}) {
          const Vector by = B(none, Matrix::Zero(1, 2), Vector::Constant(1, later));
          EXPECT_NEAR(-back / kMass * later, by(4), 1e-4) << mu << ", " << offset << ", " << later;
        }
      }
    }
  }
}

/// A point at rest is lifted by r t, and lets go where that is its weight: it rises by r s³/6. Up
/// to 1e-6 s before or behind, it is pressed down by P and pushed along by f > μ P, and slides:
///   v = (f − μ P) s + μ r s²/2,      ∂v/∂f = s,      ∂v/∂P = −μ s,      ∂v/∂t = −(f − μ P).
/// What it has risen by until then is none.
TEST(InputAtEvent, PointThatHasJustLetGoIsPressedBack) {
  constexpr double kRate = 20, kMu = 0.5, kAfter = 0.3, kPush = 8, kPress = 10;
  constexpr double kGains = kPush - kMu * kPress;
  const auto point =
      MakeSystem<test::LiftedMass>({{"rate", kRate}, {"friction", kMu}, {"gravity", kGravity}});
  const double at = kGravity / kRate, s = kAfter;
  for (const double tolerance : {1e-9, 1e-12}) {
    for (const double offset : Offsets(at)) {
      const InputSchedule schedule{{0, at + offset},
                                   {Vector::Zero(2), test::Entries({kPush, -kPress})}};
      const Trajectory run =
          Simulate(*point, point->nominal().x, schedule, at + s, AtTolerance(tolerance));
      ASSERT_TRUE(run.status.ok()) << offset << ": " << run.status.message;
      EXPECT_LE(run.transitions.size(), 2u) << offset;
      EXPECT_TRUE(run.warnings.empty()) << offset << ": " << run.warnings.front().message;
      const double near = 1e-9 + 10 * std::abs(offset);
      EXPECT_NEAR(kGains * s + 0.5 * kMu * kRate * s * s, run.FinalState()(3), near) << offset;
      EXPECT_NEAR(0, run.FinalState()(1), 1e-15) << offset;
      const GridDerivative B(*point, run);
      ASSERT_TRUE(B.status().ok()) << offset << ": " << B.status().message;
      const Vector none = Vector::Zero(6);
      const Matrix same = Matrix::Zero(2, 2);
      Matrix du = same;
      du.col(1) = test::Entries({1, 0});
      EXPECT_NEAR(s, B(none, du)(3), 1e-9 + 2 * std::abs(offset)) << offset;
      du.col(1) = test::Entries({0, -1});
      EXPECT_NEAR(-kMu * s, B(none, du)(3), 1e-9 + 2 * std::abs(offset)) << offset;
      for (const double later : {1.0, -1.0}) {
        const double by = B(none, same, Vector::Constant(1, later))(3);
        EXPECT_NEAR(-kGains * later, by, 1e-9 + 20 * std::abs(offset)) << offset;
      }
    }
  }
}

/// A box on two corners slides, and stops where it is pushed: by F > μ m g, or back, F < −μ m g.
/// Where the change comes before by rounding, it ends both slips. With δ = v at the instant of the
/// change, or 0 where it has stopped, a = F/m − μ g and b = F/m + μ g,
///   δv(T) = δ − a δt,      δv(T) = b (δ/a − δt)      for a push, and back.
TEST(InputAtEvent, BoxThatIsPushedWhereItStops) {
  constexpr double kMass = 2, kMu = 0.4, kSpeed = 1.1, kAfter = 0.3, kSlows = kMu * kGravity;
  const auto box = MakeSystem<test::FlatBox>(
      {{"mass", kMass}, {"friction", kMu}, {"arm", 0}, {"width", 2}, {"height", 0.2}});
  Vector x = box->nominal().x;
  x(4) = kSpeed;
  const double at = kSpeed / kSlows, last = std::nextafter(at, 1) - at;
  for (const double push : {13.0, -13.0}) {
    const double forward = push / kMass - kSlows, back = push / kMass + kSlows;
    for (const double offset : {0.0, last, -last, 1e-15, -1e-15, 1e-14, -1e-14}) {
      const InputSchedule schedule{{0, at + offset}, {Vector::Zero(1), Vector::Constant(1, push)}};
      const Trajectory alike = Simulate(*box, x, schedule, at + kAfter, AtTolerance(1e-9));
      ASSERT_TRUE(alike.status.ok()) << push << ", " << offset << ": " << alike.status.message;
      const GridDerivative there(*box, alike);  // to one side, where these are told apart
      EXPECT_TRUE(there.status().ok()) << push << ", " << offset << ": " << there.status().message;
      SimulateOptions options = AtTolerance(1e-12);
      options.simultaneity_tolerance = 1e-9;
      const Trajectory run = Simulate(*box, x, schedule, at + kAfter, options);
      ASSERT_TRUE(run.status.ok()) << push << ", " << offset << ": " << run.status.message;
      EXPECT_LE(run.transitions.size(), 2u) << push << ", " << offset;
      EXPECT_NEAR((push > 0 ? forward : back) * kAfter, run.FinalState()(4), 1e-10) << offset;
      const GridDerivative B(*box, run);
      ASSERT_TRUE(B.status().ok()) << push << ", " << offset << ": " << B.status().message;
      for (const double faster : {1.0, -1.0}) {
        for (const double later : {0.0, 0.1, -0.1}) {
          Vector dx = Vector::Zero(8);
          dx(4) = faster;
          const double delta = std::max(faster - kSlows * later, 0.0);
          const double expected =
              push > 0 ? delta - forward * later : back * (delta / forward - later);
          EXPECT_NEAR(expected, B(dx, Matrix::Zero(1, 2), Vector::Constant(1, later))(4), 1e-9)
              << push << ", " << offset << ", " << faster << ", " << later;
        }
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
