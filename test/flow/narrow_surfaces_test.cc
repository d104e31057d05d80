// SPDX-License-Identifier: BSD-3-Clause
// Points in free flight against surfaces that are narrow beside a step of the motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <string>

#include "test/flow/first_zero.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::FirstZero;

std::string Digits(double value) {
  std::ostringstream text;
  text.precision(17);
  text << value;
  return text.str();
}

struct Throw {
  double speed, rise, height, duration;

  Vector At(double t) const {
    const double g = test::kGravity;
    return test::Entries({speed * t, height + rise * t - g / 2 * t * t, 0});
  }
};

/// A point that flies in a plane, above or beside one surface.
struct ThrownPoint {
  std::unique_ptr<RobotSystem> robot;
  Throw thrown;

  ThrownPoint(const std::string& surface, const Throw& thrown)
      : robot(test::Robot("<robot name='flight'>" + test::Link("point", 1, 1, 1, 1) + "</robot>",
                          "{base: planar, constraints: {surface: {link: point, restitution: 0.5, " +
                              surface + "}}}")),
        thrown(thrown) {}

  double Gap(double t) const {
    ConstraintTerms terms;
    robot->Constraints(thrown.At(t), Vector::Zero(3), &terms);
    return terms.gap(0);
  }
  /// Whether it stays closed for this way behind t.
  bool StaysClosed(double t, double way) const {
    for (int k = 1; k <= 50; ++k) {
      const double later = t + way / thrown.speed * k / 50;
      if (later < thrown.duration && !(Gap(later) < 0)) return false;
    }
    return t + way / thrown.speed < thrown.duration;
  }
  /// The run finds what the parabola meets first; false where that is too short to be told of.
  bool IsStopped(double width, const SimulateOptions& options) const {
    const double first =
        FirstZero([&](double t) { return Gap(t); }, width / (40 * thrown.speed), thrown.duration);
    if (!(Gap(0) > 0.01) || !(first < thrown.duration)) return false;
    if (!StaysClosed(first, width / 4)) return false;
    Vector x = Vector::Zero(6);
    x.head(3) = thrown.At(0);
    x(3) = thrown.speed;
    x(4) = thrown.rise;
    const Trajectory run = Simulate(*robot, x, Vector::Zero(0), thrown.duration, options);
    EXPECT_FALSE(run.transitions.empty()) << "passes through, at " << first;
    if (!run.transitions.empty()) {
      EXPECT_NEAR(first, run.transitions[0].t, 1e-6);
    }
    return true;
  }
};

std::string Wall(double x, double length) {
  return "kind: box, center: [" + Digits(x) + ", 0, 1.5], length: " + Digits(length) +
         ", width: 9, height: 3, riser: " + Digits(std::min(0.02, length / 4));
}

/// By each method, at its default tolerance and a tight one.
template <class Visit>
void ForOptions(const Visit& visit) {
  for (const IntegrationMethod method :
       {IntegrationMethod::kAutomatic, IntegrationMethod::kExplicit,
        IntegrationMethod::kImplicit}) {
    for (const bool tight : {false, true}) {
      SimulateOptions options;
      if (tight) options = AtTolerance(1e-12);
      options.method = method;
      visit(options);
    }
  }
}

TEST(NarrowSurfaces, StopWhatIsThrownAtWalls) {
  const double throws[][6] = {{0.84188, 6.2857, 1.2391, 2.1011, 1.141, 0.52735},
                              {0.35552, 2.7886, 1.1588, 2.299, 2.5533, 0.58176},
                              {0.33556, 3.0602, 0.49938, 2.619, 2.3528, 0.43087},
                              {0.3825, 5.57316, 3.61871, 2.80223, 0.031086, 0.908}};
  for (const auto& [length, speed, x, height, rise, duration] : throws) {
    const ThrownPoint point(Wall(x, length), {speed, rise, height, duration});
    ForOptions([&](const SimulateOptions& options) {
      EXPECT_TRUE(point.IsStopped(length, options)) << "at " << x;
    });
  }
}

TEST(NarrowSurfaces, StopThrowsAtRandom) {
  std::mt19937 generator(7);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator);
  };
  const std::string flat = "0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0";
  const std::string row = "[" + flat + ", 9, " + flat + "]";
  int met[4] = {};
  for (int k = 0; k < 280; ++k) {
    const int kind = (k / 3) % 4;
    const double width = std::pow(10, uniform(-3, 0)), speed = uniform(1, 8);
    const double x = width + uniform(0.1, 0.6 * speed), duration = (x + width) / speed + 0.1;
    const Throw thrown{speed, uniform(-1, 5), uniform(2, 5), duration};
    const double t = x / speed, z = thrown.At(t)(1);  // where it comes to x
    const std::string surfaces[] = {
        Wall(x, width),
        "kind: stairs, height: " + Digits(z - 1.5 * width) + ", rise: " + Digits(width) +
            ", run: " + Digits(width) + ", riser: " + Digits(width / 4) + ", first: " + Digits(x) +
            ", last: " + Digits(x + 4 * width),
        "kind: spheres, radius: " + Digits(width / 2) + ", other_link: world, other_point: [" +
            Digits(x) + ", 0, " + Digits(z + width / 4) + "], other_radius: " + Digits(width / 2),
        "kind: height_map, origin: [" + Digits(x - 7 * width) + ", -50], step: [" +
            Digits(width / 2) + ", 100], heights: [" + row + ", " + row + "]"};
    SimulateOptions options;
    if (k % 3 > 0) options = AtTolerance(k % 3 == 1 ? 1e-6 : 1e-12);
    const ThrownPoint point(surfaces[kind], thrown);
    met[kind] += point.IsStopped(width, options);
  }
  for (const int count : met) EXPECT_GE(count, 10);
}

}  // namespace
}  // namespace contact_flow
