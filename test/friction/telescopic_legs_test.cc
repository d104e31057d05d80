// SPDX-License-Identifier: BSD-3-Clause
// A body in the plane on two parallel telescopic legs. With both feet on the ground their distance
// is 0.4 m / cos(pitch), which upright has its least value: there the rows of two feet that stick
// depend on each other, and the feet move apart all the same, at 0.4 m ω².
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/derivative/finite_difference.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

std::unique_ptr<RobotSystem> LeggedBody() {
  std::string urdf = "<robot name='r'>" + test::Link("body", 4, 0.1, 0.1, 0.1);
  for (const char* leg : {"left", "right"}) {
    const std::string name = leg, x = name == "left" ? "-0.2" : "0.2";
    urdf += test::Link(name, 0.5, 0.002, 0.002, 0.002) + "<joint name='" + name +
            "_slide' type='prismatic'><parent link='body'/><child link='" + name +
            "'/><origin xyz='" + x +
            " 0 -0.3'/><axis xyz='0 0 1'/><limit lower='-0.2' upper='0.2' effort='100' "
            "velocity='10'/></joint>";
  }
  const std::string foot = "point: [0, 0, -0.1], friction: 0.6}";
  const std::string spring = "stiffness: 2000, damping: 20, rest: 0}";
  return test::Robot(
      urdf + "</robot>",
      "{base: planar, gravity: 9.81, constraints: {left: {kind: plane, link: left, " + foot +
          ", right: {kind: plane, link: right, " + foot +
          "}, efforts: {left: {kind: joint_spring, joint: left_slide, " + spring +
          ", right: {kind: joint_spring, joint: right_slide, " + spring + "}}");
}

/// Each passes upright with both feet on the ground, one of which slips.
TEST(TelescopicLegs, GoOnThroughUpright) {
  const auto body = LeggedBody();
  ASSERT_EQ(5, body->dof());
  for (const double height : {0.401, 0.45, 0.6}) {
    for (const double pitch : {0.0, 0.05, -0.05}) {
      for (const double speed : {0.0, 0.3}) {
        Vector x = Vector::Zero(10);
        x(1) = height + 0.21 * std::abs(pitch);
        x(2) = pitch;
        x(3) = 0.01;  // one leg is shorter
        x(5) = speed;
        const Trajectory run = Simulate(*body, x, Vector(0), 1.0, test::AtTolerance(1e-10));
        EXPECT_TRUE(run.status.ok()) << run.status.message;
      }
    }
  }
}

}  // namespace
}  // namespace contact_flow
