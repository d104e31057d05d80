// SPDX-License-Identifier: BSD-3-Clause
// Dips of guards that nothing else tells of, at the extent that is said to be found: a ball over a
// needle, a block at rest that is pulled for a moment.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "contact_flow/flow/event_locator.h"
#include "contact_flow/flow/simulate.h"
#include "test/flow/first_zero.h"
#include "test/test_models.h"

namespace contact_flow {
namespace {

using test::FirstZero;

/// What the models below share: a coordinate that moves on evenly, and one that is pushed.
struct Even : test::UnitMasses<2, 1> {
  static constexpr bool kAffineConstraints = false;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "z"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"ground"};
};

/// A needle of height 50 over flat ground: (1 − u²)⁴, u = (x − place)/half.
template <class P, class S>
S Needle(const P& place, const P& half, const S& x) {
  const S u = (x - place) / half, rest = 1.0 - u * u;
  if (rest < 0) return 0.0 * rest;
  return 50.0 * (rest * rest) * (rest * rest);
}
/// 1 − Needle < 0 for this part of its width.
const double kBelow = std::sqrt(1 - std::pow(1.0 / 50, 0.25));

template <class P>
struct NeedleParameters {
  P place = 1, half = 1;
  template <class V>
  void Visit(V&& visit) {
    visit(place, "place", "m", "of the needle", Range::kAny);
    visit(half, "half", "m", "its width, halved", Range::kPositive);
  }
};

/// A weightless ball over a needle: z stays, x = t.
struct OverNeedle : Even {
  static constexpr const char* kName = "over_needle";
  template <class P>
  using Parameters = NeedleParameters<P>;
  template <class P, class S>
  static void Force(const P&, const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 0, 1>&, Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const NeedleParameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1) - Needle(p.place, p.half, q(0));
  }
};

/// A block on a floor, pulled once when the clock x = t says so: λ = 1 − Needle.
struct Pulled : Even {
  static constexpr bool kAffineConstraints = true;
  static constexpr const char* kName = "pulled";
  template <class P>
  using Parameters = NeedleParameters<P>;
  template <class P, class S>
  static void Force(const NeedleParameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = Needle(p.place, p.half, q(0)) - 1.0;
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1);
  }
};

/// The same two beside an oscillator y = cos t, which limits the step: a ball that rides on it over
/// a needle, z = y + 1.2, and a block that is pulled.
template <bool kBlock>
struct Beside : test::UnitMasses<3, 1> {
  static constexpr bool kAffineConstraints = kBlock;
  static constexpr const char* kName = "beside";
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "y"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"ground"};
  template <class P>
  using Parameters = NeedleParameters<P>;
  template <class P, class S>
  static void Force(const NeedleParameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = kBlock ? Needle(p.place, p.half, q(0)) - 1.0 : S(0.0);
    (*f)(2) = -1.0 * q(2);
  }
  template <class P, class S>
  static void Gaps(const NeedleParameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    if (kBlock) {
      (*a)(0) = q(1);
    } else {
      (*a)(0) = q(2) + 1.2 - Needle(p.place, p.half, q(0));
    }
  }
};

/// At the stated extent, and at twice that, a needle is found wherever it is.
TEST(QuickGaps, EveryNeedleOfTheStatedExtent) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.max_step = 0.5;
  options.max_events = 1;
  Vector x(4);
  x << 0, 1, 1, 0;
  for (double times : {1.0, 2.0}) {
    const double extent = times * EventLocator::kGapExtentFree * options.max_step;
    for (int k = 0; k < 1000; ++k) {
      const double place = 0.2 + 2.5 * uniform(random);
      const auto system = test::Make<OverNeedle>({{"place", place}, {"half", extent / 2 / kBelow}});
      const Trajectory run = Simulate(system, x, Vector(0), 3, options);
      ASSERT_FALSE(run.transitions.empty()) << times << " extents, needle at " << place;
      EXPECT_NEAR(place - extent / 2, run.transitions.front().t, 1e-9);
    }
  }
}

TEST(QuickForces, EveryPullOfTheStatedExtent) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.max_step = 0.5;
  options.max_events = 1;
  Vector x(4);
  x << 0, 0, 1, 0;
  for (double times : {1.0, 2.0}) {
    const double extent = times * EventLocator::kForceExtentFree * options.max_step;
    for (int k = 0; k < 1000; ++k) {
      const double place = 0.2 + 2.5 * uniform(random);
      const auto system = test::Make<Pulled>({{"place", place}, {"half", extent / 2 / kBelow}});
      const Trajectory run = Simulate(system, x, Vector(0), 3, options);
      ASSERT_FALSE(run.transitions.empty()) << times << " extents, pull at " << place;
      EXPECT_NEAR(place - extent / 2, run.transitions.front().t, 1e-9);
    }
  }
}

/// Where the error of the motion limits the step: extents are parts of the longest step of the run
/// without a needle, found at random places over a period.
template <bool kBlock>
void ExpectNeedlesFound(double part) {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> uniform(0, 1);
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-6;
  Vector x(6);
  x << 0, 0, 1, 1, 0, 0;
  const auto none = test::Make<Beside<kBlock>>({{"place", -100}});
  const Trajectory smooth = Simulate(none, x, Vector(0), 9, options);
  ASSERT_TRUE(smooth.transitions.empty());
  double longest = 0;
  for (std::size_t k = 0; k < smooth.arcs[0].dense.NumSteps(); ++k) {
    longest = std::max(longest, smooth.arcs[0].dense.StepLength(k));
  }
  options.max_events = 1;
  // The needle stands 50 high where at most 2.2 are free, and is below for more than this part.
  const double below = std::sqrt(1 - std::pow(2.2 / 50, 0.25));
  for (double times : {1.0, 2.0}) {
    const double half = times * part * longest / 2 / below;
    for (int k = 0; k < 500; ++k) {
      const double place = 1.5 + 2 * M_PI * uniform(random);
      const auto system = test::Make<Beside<kBlock>>({{"place", place}, {"half", half}});
      const auto guard = [&](double t) {
        return (kBlock ? 1 : std::cos(t) + 1.2) - Needle(place, half, t);
      };
      const Trajectory run = Simulate(system, x, Vector(0), 9, options);
      ASSERT_FALSE(run.transitions.empty()) << times << " extents, needle at " << place;
      // The state is right to some 1e-6, and falls at 10/half at least.
      EXPECT_NEAR(FirstZero(guard, 1e-3, 9), run.transitions.front().t, 1e-5) << place;
    }
  }
}

TEST(QuickGaps, AndOnStepsThatTheMotionLimits) {
  ExpectNeedlesFound<false>(EventLocator::kGapExtent);
}

TEST(QuickForces, AndOnStepsThatTheMotionLimits) {
  ExpectNeedlesFound<true>(EventLocator::kForceExtent);
}

/// A resting block under a constant load is not looked at more closely: as many right-hand sides as
/// its steps take, and two probes a step.
TEST(QuickForces, CostNothingWhereTheyAreConstant) {
  const auto system = test::Make<Pulled>({{"place", -10}, {"half", 1}});
  Vector x(4);
  x << 0, 0, 1, 0;
  SimulateOptions options;
  options.dense = false;
  const Trajectory run = Simulate(system, x, Vector(0), 100, options);
  EXPECT_TRUE(run.transitions.empty());
  EXPECT_EQ(0, run.statistics.rejected_steps);
  // 11 and the end, two probes; three for the initial mode and the first step.
  EXPECT_LE(run.statistics.field_evaluations, 14 * run.statistics.steps + 3);
}

}  // namespace
}  // namespace contact_flow
