// SPDX-License-Identifier: BSD-3-Clause
// A cart and an arm, and derivatives of what controls them.
#pragma once

#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"
#include "test/refusal.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace test {

inline std::string Link(const std::string& name, const std::string& mass,
                        const std::string& z = "0") {
  return "<link name=\"" + name + "\"><inertial><origin xyz=\"0 0 " + z + "\"/><mass value=\"" +
         mass + "\"/><inertia ixx=\"0.3\" iyy=\"0.4\" izz=\"0.5\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/>" +
         "</inertial></link>\n";
}
inline std::string Joint(const std::string& name, const std::string& type,
                         const std::string& parent, const std::string& child,
                         const std::string& axis, const std::string& xyz = "0 0 0") {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><origin xyz=\"" + xyz + "\"/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/></joint>\n";
}
inline std::string Robot(const std::string& content) {
  return "<robot name=\"r\"><link name=\"world\"/>\n" + content + "</robot>";
}
/// A mass of 2 kg on a level rail.
inline const std::string& Cart() {
  static const std::string text =
      Robot(Link("cart", "2") + Joint("x", "prismatic", "world", "cart", "1 0 0"));
  return text;
}
/// Two rods that swing about y below the world.
inline const std::string& Arm() {
  static const std::string text =
      Robot(Link("upper", "1.5", "-0.3") + Link("lower", "0.8", "-0.2") +
            Joint("shoulder", "continuous", "world", "upper", "0 1 0") +
            Joint("elbow", "continuous", "upper", "lower", "0 1 0", "0 0 -0.6"));
  return text;
}
inline RobotSystem Make(const std::string& urdf, const std::string& yaml,
                        const ParameterValues& values = {}) {
  return RobotSystem(ParseRobot(urdf, YAML::Load(yaml)), values);
}
inline std::string Refusal(const std::string& urdf, const std::string& yaml) {
  return RefusalOf([&] { Make(urdf, yaml); });
}

/// Errors of one-sided quotients fall with slope 1 in every direction (δq, δv, δu, δp), or are
/// rounding of runs at 1e-12 over the steps of the quotients.
inline void ExpectSlopeOne(const std::string& urdf, const std::string& yaml, double duration) {
  const RobotSystem system = Make(urdf, yaml);
  const Vector x = system.nominal().x, u = system.nominal().u;
  Variables variables;
  variables.inputs = true;
  for (std::size_t k = 0; k < system.description().parameters.size(); ++k) {
    variables.parameters.push_back(static_cast<int>(k));
  }
  const Trajectory run = Simulate(system, x, u, duration, Tight());
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  BDerivativeOptions options;
  options.tolerance = 1e-11;
  options.variables = variables;
  const BDerivative B = DifferentiateOutcome(system, run, options);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const SystemFactory factory = [&](const ParameterValues& values) {
    return std::make_unique<RobotSystem>(ParseRobot(urdf, YAML::Load(yaml)), values);
  };
  const Eigen::Index n = 2 * system.dof() + variables.Size(system);
  for (Eigen::Index k = 0; k < n; ++k) {
    for (const double sign : {1.0, -1.0}) {
      const Vector w = sign * Vector::Unit(n, k);
      const QuotientReport report =
          CompareWithQuotients(system, factory, variables, x, InputSchedule::Constant(u), duration,
                               w, B(w), {1e-3, 1e-4, 1e-5}, Tight(), 1e-9);
      for (const QuotientSample& sample : report.samples) {
        ASSERT_TRUE(sample.status.ok()) << sample.status.message;
        EXPECT_LE(sample.error, 100 * sample.alpha * (1 + B(w).norm()) + 1e-6) << "direction " << k;
      }
      if (!std::isnan(report.slope)) {
        EXPECT_NEAR(1, report.slope, 0.1) << "direction " << k;
      }
    }
  }
}

}  // namespace test
}  // namespace contact_flow
