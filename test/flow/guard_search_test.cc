// SPDX-License-Identifier: BSD-3-Clause
// Guards that are formulas: the truth is a scan at a hundredth of their shortest scale.
#include "contact_flow/flow/guard_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>

#include "src/flow/guard_interpolant.h"

namespace contact_flow {
namespace {

constexpr double kFloor = 1e-9;
const ConstraintSet kOnly({0});

struct Result {
  LocatedEvent event;
  double margin = std::numeric_limits<double>::infinity();
  long samples = 0;
};

template <class Guard, class Rate>
Result Search(const Guard& guard, const Rate& rate, int pieces, int max_samples = 100000) {
  GuardSearch search(1, [&](double theta, ConstraintSet, double* value, double* slope) {
    *value = guard(theta);
    *slope = rate(theta);
  });
  Result result;
  search.Run({kOnly, &kFloor, true, true, pieces, max_samples}, &result.margin, &result.event);
  result.samples = search.samples();
  return result;
}

/// The first θ with guard(θ) < −kFloor, by steps of `step` and bisection; 2 if there is none.
template <class Guard>
double Scan(const Guard& guard, double step) {
  const long count = std::lround(std::ceil(1 / step));
  for (long k = 1; k <= count; ++k) {
    double left = static_cast<double>(k - 1) / count, right = static_cast<double>(k) / count;
    if (guard(right) >= -kFloor) continue;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (left + right) / 2;
      (guard(middle) < 0 ? right : left) = middle;
    }
    return right;
  }
  return 2;
}

/// The earliest zero of sinusoids of 0.1 to 1000 rad over the step, on parabolas: the guard's
/// frequency has nothing to do with the step.
TEST(GuardSearches, FindTheEarliestZeroOfAnyFrequency) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> uniform(0, 1);
  int found = 0;
  double samples = 0;
  for (int k = 0; k < 1500; ++k) {
    const double frequency = std::pow(10, 4 * uniform(random) - 1);
    const double amplitude = std::pow(10, -2 * uniform(random)), phase = 2 * M_PI * uniform(random);
    const double mean = amplitude * (1.2 + 2 * uniform(random));
    const double slope = 0.3 * amplitude * (uniform(random) - 0.5);
    const double bend = -3 * amplitude * uniform(random);
    const auto guard = [&](double s) {
      return mean + slope * s + bend * s * s + amplitude * std::sin(frequency * s + phase);
    };
    const auto rate = [&](double s) {
      return slope + 2 * bend * s + amplitude * frequency * std::cos(frequency * s + phase);
    };
    const Result result = Search(guard, rate, 4);
    const double truth = Scan(guard, std::min(1e-3, 0.01 / frequency));
    samples += result.samples;
    if (result.event.touch) {  // within ten floors of zero
      EXPECT_NEAR(0, guard(result.event.theta), 10 * kFloor);
      continue;
    }
    ASSERT_EQ(truth < 2, result.event.found) << "frequency " << frequency << ", run " << k;
    if (truth > 1) continue;
    // The roots of one function: both by bracketing, the scan's to 1e-3·2⁻⁶⁰.
    EXPECT_NEAR(truth, result.event.theta, 1e-12) << "frequency " << frequency << ", run " << k;
    ++found;
  }
  EXPECT_GT(found, 500);
  RecordProperty("samples", static_cast<int>(samples / 1500));
}

/// A needle that nothing else tells of, at random places. It is below zero for the stated extent,
/// and for twice that.
TEST(GuardSearches, FindEveryNeedleOfTheStatedExtent) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int pieces : {4, 8, 17}) {
    for (double times : {1.0, 2.0}) {
      const double extent = times * GuardSearch::kLargestHole / pieces;
      // 1 − 50 (1 − u²)⁴ < 0 where |u| < 0.79: the needle is as wide as the dip lasts, over 0.79.
      const double half = extent / 2 / std::sqrt(1 - std::pow(1.0 / 50, 0.25));
      for (int k = 0; k < 1000; ++k) {
        const double place = extent / 2 + (1 - extent) * uniform(random);
        const auto guard = [&](double s) {
          const double u = (s - place) / half;
          return std::abs(u) < 1 ? 1 - 50 * std::pow(1 - u * u, 4) : 1;
        };
        const auto rate = [&](double s) {
          const double u = (s - place) / half;
          return std::abs(u) < 1 ? 400 * u * std::pow(1 - u * u, 3) / half : 0;
        };
        const Result result = Search(guard, rate, pieces);
        ASSERT_TRUE(result.event.found) << pieces << " pieces, needle at " << place;
        // Root to rounding of its place: 1e-16 over a slope of 100.
        EXPECT_NEAR(place - extent / 2, result.event.theta, 1e-12);
      }
    }
  }
}

/// After a release the gap is zero, and so is its rate: it rises first.
TEST(GuardSearches, AGapThatRisesFromRestDoesNotClose) {
  for (double fall : {0.7, 0.9, 0.99, 1.5}) {
    const auto guard = [&](double s) { return s * s * (fall - s); };
    const auto rate = [&](double s) { return s * (2 * fall - 3 * s); };
    const Result result = Search(guard, rate, 2);
    EXPECT_EQ(fall < 1, result.event.found);
    EXPECT_NEAR(std::min(fall, 1.0), result.event.theta, 1e-12);
    EXPECT_FALSE(result.event.touch);
  }
}

TEST(GuardSearches, TellHowFarTheyGotWhereAGuardIsTooQuick) {
  const auto guard = [](double s) { return 1.5 - s + std::sin(1e6 * s); };
  const auto rate = [](double s) { return -1 + 1e6 * std::cos(1e6 * s); };
  const Result result = Search(guard, rate, 8, 1000);
  EXPECT_FALSE(result.event.found);
  EXPECT_EQ(0, result.event.constraint);
  EXPECT_GT(result.event.theta, 0);
  EXPECT_LT(result.event.theta, 0.5) << "the first zero";
  EXPECT_LT(result.samples, 1100);
}

TEST(GuardSearches, TellTheSmallestMinimumThatWasPassed) {
  for (int k = 0; k < 30; ++k) {
    const double frequency = 3 + 2 * k;
    const auto guard = [&](double s) { return 2 - s + std::cos(frequency * s); };
    const auto rate = [&](double s) { return -1 - frequency * std::sin(frequency * s); };
    double truth = std::numeric_limits<double>::infinity();
    for (int j = 1; j < 100000; ++j) {
      const double value = guard(1e-5 * j);
      if (value < guard(1e-5 * (j - 1)) && value < guard(1e-5 * (j + 1))) {
        truth = std::min(truth, value);
      }
    }
    const Result result = Search(guard, rate, 4);
    ASSERT_FALSE(result.event.found);
    // The scan is off by ½ f² (5e-6)²; where a guard is not resolved, by half at most, and below.
    EXPECT_LE(result.margin, truth + 1e-5) << frequency;
    if (std::isfinite(truth)) {
      EXPECT_GE(result.margin, 0.5 * truth - 1e-5) << frequency;
    }
  }
}

TEST(GuardInterpolants, AFarSinusoidHasNoZero) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  int far = 0;
  for (int k = 0; k < 100000; ++k) {
    const double h = std::pow(10, 4 * uniform(random) - 3);
    const double w = std::pow(10, 4 * uniform(random) - 1);
    const double phase = 2 * M_PI * uniform(random), mean = 3 * uniform(random);
    const auto jet = [&](double t) {
      return GuardJet{mean + std::sin(w * t + phase), w * std::cos(w * t + phase),
                      -w * w * std::sin(w * t + phase)};
    };
    if (!IsFar(h, jet(0), jet(h))) continue;
    ++far;
    const auto guard = [&](double s) { return jet(s * h).value; };
    ASSERT_EQ(2, Scan(guard, std::min(0.1, 0.1 / (w * h)))) << "h " << h << ", w " << w;
  }
  EXPECT_GT(far, 1000);
}

/// A gap that was closed where the step begins, and that rises and falls all within its floor, has
/// come back where it passes zero at more than the speed that is asked for, and nowhere else.
TEST(GuardSearches, FindWhatComesBackWithinItsFloor) {
  const double floor = 1e-2;
  // 0 at 0, 0.4 and 1; the rates there are 4e-3, −2.4e-3 and 6e-3.
  const auto gap = [](double s) { return 1e-2 * s * (s - 0.4) * (s - 1); };
  const auto rate = [](double s) { return 1e-2 * (3 * s * s - 2.8 * s + 0.4); };
  for (const auto& [fall, low, found] :
       {std::tuple(2e-3, true, true), {3e-3, true, false}, {2e-3, false, false}}) {
    GuardSearch search(1, [&](double theta, ConstraintSet, double* value, double* slope) {
      *value = gap(theta);
      *slope = rate(theta);
    });
    double margin = std::numeric_limits<double>::infinity();
    LocatedEvent event;
    GuardQuery query = {kOnly, &floor, false, true, 4, 1000};
    query.low = low ? kOnly : ConstraintSet();
    query.fall = fall;
    search.Run(query, &margin, &event);
    EXPECT_EQ(found, event.found) << fall;
    if (found) EXPECT_NEAR(0.4, event.theta, 1e-9);
  }
}

}  // namespace
}  // namespace contact_flow
