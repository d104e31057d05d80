// SPDX-License-Identifier: BSD-3-Clause
// A ball and a block on rails above ground that may move, and their derivatives.
#pragma once

#include <cmath>
#include <sstream>
#include <string>

#include "test/io/controlled_robots.h"

namespace contact_flow {
namespace test {

inline constexpr double kTwoPi = 2 * M_PI;

inline std::string Text(double number) {
  std::ostringstream text;
  text.precision(17);
  text << number;
  return text.str();
}
/// A ball of 1 kg on an upright rail.
inline std::string Ball() {
  return Robot(Link("ball", "1") + Joint("z", "prismatic", "world", "ball", "0 0 1"));
}
/// A block of 1 kg in the x–z plane, of which 0.5 kg move along z.
inline std::string Block() {
  return Robot(Link("mid", "0.5") + Link("block", "0.5") +
               Joint("x", "prismatic", "world", "mid", "1 0 0") +
               Joint("z", "prismatic", "mid", "block", "0 0 1"));
}
inline Trajectory RunOf(const RobotSystem& system, double duration) {
  return Simulate(system, system.nominal().x, system.nominal().u, duration, Tight());
}
inline BDerivative DifferentiateByAll(const RobotSystem& system, const Trajectory& run) {
  BDerivativeOptions options;
  options.tolerance = 1e-12;
  for (std::size_t k = 0; k < system.description().parameters.size(); ++k) {
    options.variables.parameters.push_back(static_cast<int>(k));
  }
  return DifferentiateOutcome(system, run, options);
}

inline void ExpectRefused(const Status& status, const std::string& why) {
  EXPECT_EQ(Outcome::kNotDifferentiable, status.outcome) << status.message;
  EXPECT_NE(std::string::npos, status.message.find(why)) << status.message;
}
/// One-sided quotients of runs at 1e-12 in each direction (δq, δv, δp), the clock among them.
inline void ExpectQuotients(const std::string& urdf, const std::string& yaml, double duration) {
  const RobotSystem system = Make(urdf, yaml);
  const Trajectory run = RunOf(system, duration);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  EXPECT_GE(run.transitions.size(), 1u);
  const BDerivative B = DifferentiateByAll(system, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  Variables variables;
  for (std::size_t k = 0; k < system.description().parameters.size(); ++k) {
    variables.parameters.push_back(static_cast<int>(k));
  }
  const SystemFactory factory = [&](const ParameterValues& values) {
    return std::make_unique<RobotSystem>(ParseRobot(urdf, YAML::Load(yaml)), values);
  };
  const Eigen::Index n = 2 * system.dof() + variables.Size(system);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Vector w = sign * Vector::Unit(n, k);
      const QuotientReport report =
          CompareWithQuotients(system, factory, variables, system.nominal().x,
                               InputSchedule::Constant(system.nominal().u), duration, w, B(w),
                               {1e-4, 1e-5, 1e-6}, Tight(), 1e-9);
      for (const QuotientSample& sample : report.samples) {
        ASSERT_TRUE(sample.status.ok()) << sample.status.message;
        // Half the second derivative, of up to (2π f)² at what B multiplies, and rounding of runs.
        EXPECT_LE(sample.error, 300 * sample.alpha * (1 + B(w).norm()) + 1e-10 / sample.alpha)
            << "direction " << w.transpose() << ", " << sample.alpha;
      }
    }
  }
}

}  // namespace test
}  // namespace contact_flow
