// SPDX-License-Identifier: BSD-3-Clause
// Derivatives by a restitution that is zero, with friction, beside runs that bounce a little.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "test/io/moving_robots.h"

namespace contact_flow {
namespace {

using test::Make;
using test::Text;

/// A body with feet, at random: in the plane or in space.
struct Body {
  std::string urdf, yaml;
};
Body RandomBody(unsigned seed, bool space, int feet) {
  std::mt19937 random(seed);
  const auto draw = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto text = [&](double low, double high) { return Text(draw(low, high)); };
  Body body;
  body.urdf =
      "<robot name=\"body\"><link name=\"body\"><inertial><mass value=\"2\"/>"
      "<inertia ixx=\"" +
      text(0.05, 0.1) + "\" iyy=\"" + text(0.05, 0.1) + "\" izz=\"" + text(0.05, 0.1) +
      "\" ixy=\"0.01\" ixz=\"-0.02\" iyz=\"0\"/></inertial></link></robot>";
  std::string constraints, parameters;
  for (int k = 0; k < feet; ++k) {
    const std::string name = "foot" + std::to_string(k);
    constraints += name + ": {kind: plane, link: body, point: [" + text(-0.2, 0.2) + ", " +
                   (space ? text(-0.2, 0.2) : "0") + ", " + text(-0.4, -0.2) +
                   "], friction: " + text(0.2, 1.2) + "}, ";
    parameters += "restitution" + std::to_string(k) + ": " + name + "/restitution, ";
  }
  body.yaml =
      std::string("{base: ") + (space ? "floating" : "planar") + ", constraints: {" + constraints +
      "}, parameters: {" + parameters + "}, nominal: {positions: {base_z: 0.7" +
      (space ? "" : ", base_pitch: " + text(-0.2, 0.2)) + "}, velocities: {base_x: " + text(-1, 1) +
      ", " + (space ? "base_wy: " : "base_pitch: ") + text(-3, 3) +
      (space ? ", base_y: " + text(-1, 1) + ", base_wx: " + text(-2, 2) : "") + "}}}";
  return body;
}

struct Counts {
  int compared = 0, moved = 0, refused = 0;
};
/// Beside one-sided quotients by each restitution: errors fall like the step.
void Compare(const Body& body, Counts* counts) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  options.complete_zeno = true;
  const RobotSystem plastic = Make(body.urdf, body.yaml);
  const Vector x = plastic.nominal().x, u = plastic.nominal().u;
  const Trajectory run = Simulate(plastic, x, u, 0.5, options);
  if (!run.status.ok() || run.transitions.empty()) return;
  BDerivativeOptions by;
  by.tolerance = 1e-11;
  const auto count = static_cast<int>(plastic.description().parameters.size());
  for (int k = 0; k < count; ++k) by.variables.parameters.push_back(k);
  const BDerivative B = DifferentiateOutcome(plastic, run, by);
  if (!B.status.ok()) {
    ++counts->refused;
    return;
  }
  for (int k = 0; k < count; ++k) {
    const int d = plastic.dof();
    const Vector expected = B(Vector::Unit(2 * d + count, 2 * d + k));
    std::vector<double> errors;
    for (const double step : {1e-3, 1e-4}) {
      const RobotSystem elastic =
          Make(body.urdf, body.yaml, {{plastic.description().parameters[k].name, step}});
      const Trajectory other = Simulate(elastic, x, u, 0.5, options);
      if (!other.status.ok()) return;
      const Vector quotient = plastic.Separation(other.FinalState(), run.FinalState()) / step;
      errors.push_back((quotient - expected).cwiseAbs().maxCoeff());
    }
    ++counts->compared;
    counts->moved += expected.norm() > 1e-3;
    EXPECT_LT(errors[1], 0.2 * errors[0] + 1e-4 * (1 + expected.norm())) << body.yaml << "\n"
                                                                         << expected.transpose();
  }
}

TEST(LittleRestitution, AddsWhatBouncesTakeLonger) {
  for (const bool space : {false, true}) {
    for (const int feet : {1, 2}) {
      Counts counts;
      for (unsigned seed = 0; seed < 30; ++seed) Compare(RandomBody(seed, space, feet), &counts);
      std::printf("%s, %d feet: %d compared, %d that move, %d refused\n", space ? "space" : "plane",
                  feet, counts.compared, counts.moved, counts.refused);
      EXPECT_GE(counts.compared, 15);
      EXPECT_GE(counts.moved, 4);
    }
  }
}

}  // namespace
}  // namespace contact_flow
