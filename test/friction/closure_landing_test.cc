// SPDX-License-Identifier: BSD-3-Clause
// A double pendulum that lands with friction: its pivot once a hinge, once a loop closure.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "test/friction/robot_twins.h"
#include "test/shorthands.h"

namespace contact_flow {
namespace {

using test::AtTolerance;
using test::Entries;
using test::Robot;

/// The pivot is this far behind the origin of the upper link.
constexpr double kPivot = 0.2;

std::string Links(double origin) {
  const auto link = [](const char* name, double com) {
    return std::string("<link name='") + name + "'><inertial><origin xyz='" + std::to_string(com) +
           " 0 0'/><mass value='1'/><inertia ixx='0.01' ixy='0' ixz='0' iyy='0.01' iyz='0' "
           "izz='0.01'/></inertial></link>";
  };
  return link("upper", 0.3 - origin) + link("lower", 0.3) +
         "<joint name='elbow' type='continuous'><parent link='upper'/><child link='lower'/>"
         "<origin xyz='" +
         std::to_string(0.6 - origin) + " 0 0'/><axis xyz='0 1 0'/></joint></robot>";
}

std::string LandingTip(const std::string& friction) {
  return "constraints: {tip: {kind: plane, link: lower, point: [0.6, 0, 0], offset: -0.6, "
         "friction: " +
         friction + "}}\n";
}

/// The impulses of the closure turn with the body that they hold: their part in Ξ.
TEST(ClosureLanding, HasTheDerivativeOfAHinge) {
  const std::string hinge =
      "<joint name='pivot' type='continuous'><parent link='ground'/>"
      "<child link='upper'/><axis xyz='0 1 0'/></joint>";
  for (const char* friction : {"0.4", "no_slip"}) {
    const auto plain = Robot("<robot name='hinged'><link name='ground'/>" + hinge + Links(0),
                             "base: fixed\n" + LandingTip(friction));
    const auto closed = Robot("<robot name='closed'>" + Links(kPivot),
                              "base: planar\nclosures: {pin: {link: upper, point: [-0.2, 0, 0], "
                              "other_link: world, other_point: [0, 0, 0], axes: xz}}\n" +
                                  LandingTip(friction));
    const double pitch = 0.1, elbow = 0.3, s = std::sin(pitch), c = std::cos(pitch);
    const auto outcome = [&](const auto& robot, const Vector& x, const Vector& w) {
      const Trajectory run = Simulate(*robot, x, Vector(), 0.4, AtTolerance(1e-12));
      EXPECT_TRUE(run.status.ok()) << run.status.message;
      EXPECT_EQ(1u, run.transitions.size());
      BDerivativeOptions options;
      options.tolerance = 1e-11;
      const BDerivative B = DifferentiateOutcome(*robot, run, options);
      EXPECT_TRUE(B.status.ok()) << B.status.message;
      return B(w);
    };
    // (pitch, elbow) and (x, z, pitch, elbow)
    const Vector one = outcome(plain, Entries({pitch, elbow, 0, 0}), Entries({1, 0, 0, 0}));
    const Vector other =
        outcome(closed, Entries({kPivot * c, -kPivot * s, pitch, elbow, 0, 0, 0, 0}),
                Entries({-kPivot * s, -kPivot * c, 1, 0, 0, 0, 0, 0}));
    EXPECT_TRUE(one.isApprox(Entries({other(2), other(3), other(6), other(7)}), 1e-8))
        << friction << ": " << one.transpose() << " and " << other.transpose();
  }
}

}  // namespace
}  // namespace contact_flow
