// SPDX-License-Identifier: BSD-3-Clause
// Boxes that a finger pushes over the ground, which sticks to their face. One turns on four
// corners, and how all share what they bear decides its motion; one has tipped, and falls back.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

constexpr int kFinger = 4;

/// A box on a joint, and a finger on a slide along x.
std::string BoxAndFinger(const std::string& inertial, const std::string& joint,
                         const std::string& finger_mass, const std::string& finger_place) {
  return R"(<robot name="pushed_box"><link name="world"/>
  <link name="box"><inertial>)" +
         inertial + R"(</inertial></link>
  <joint name="box" )" +
         joint + R"(<parent link="world"/><child link="box"/></joint>
  <link name="finger"><inertial><mass value=")" +
         finger_mass + R"("/>
    <inertia ixx="0.001" iyy="0.001" izz="0.001" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="finger" type="prismatic"><parent link="world"/><child link="finger"/>
    <origin xyz=")" +
         finger_place + R"("/><axis xyz="1 0 0"/>
    <limit lower="-9" upper="9" effort="99" velocity="9"/></joint>
</robot>)";
}

constexpr char kTurningBox[] = R"(<mass value="0.879384"/>
    <inertia ixx="0.00250882" iyy="0.00295357" izz="0.00114659" ixy="0" ixz="0" iyz="0"/>)";
constexpr char kTippingBox[] = R"(<mass value="1.3889"/>
    <inertia ixx="0.00514512" iyy="0.00715767" izz="0.00572266" ixy="0" ixz="0" iyz="0"/>)";
constexpr char kYaml[] = R"(
base: fixed
constraints:
  corner_0: {kind: plane, link: box, point: [0.0521, 0.0346, -0.0858], friction: 0.315}
  corner_1: {kind: plane, link: box, point: [0.0521, -0.0346, -0.0858], friction: 0.315}
  corner_2: {kind: plane, link: box, point: [-0.0521, 0.0346, -0.0858], friction: 0.315}
  corner_3: {kind: plane, link: box, point: [-0.0521, -0.0346, -0.0858], friction: 0.315}
  finger: {kind: link_plane, link: finger, radius: 0.01, friction: 0.315,
           other_link: box, other_point: [-0.0521, 0, 0], normal: [-1, 0, 0]}
efforts:
  press: {kind: actuator, joint: finger, input: force}
  damper: {kind: joint_spring, joint: finger, damping: 0.73}
nominal: {inputs: {force: 16.8}}
)";

/// The box slides and turns, the finger keeps to its face: (x, y, z, quaternion, finger), rates.
Vector Turning() {
  Vector x(15);
  x << -0.008842914381633876, -0.033639854353058815, -0.0224, 0.9998297071680444, 0, 0,
      -0.018454177420373512, 0.020156985995894893, 0.2751594716914875, -0.47244498916462957, 0, 0,
      0, -9.280566865103012, 0.5839316681023836;
  return x;
}

/// The cone of the finger is used up at 0.0314 s: it creeps, held by what the corners give way, and
/// 0.2 ms later nothing of springs holds it any more, though shares that do are admissible. It
/// slips then; no force was ever out of its cone.
TEST(PushedBox, SlipsFromTheFingerWhereSpringsHoldItNoMore) {
  const auto robot =
      MakeRobot({BoxAndFinger(kTurningBox, R"(type="floating"><origin xyz="0 0 0.1082"/>)",
                              "0.399414", "-0.0899 0 0.0837"),
                 kYaml});
  std::vector<Trajectory> runs;
  for (const double tolerance : {1e-10, 1e-12}) {
    SimulateOptions options;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    runs.push_back(Simulate(*robot, Turning(), robot->nominal().u, 0.05, options));
    ASSERT_TRUE(runs.back().status.ok()) << runs.back().status.message;
  }
  EXPECT_LT((runs[0].FinalState() - runs[1].FinalState()).cwiseAbs().maxCoeff(), 1e-7);
  const Trajectory& run = runs[1];
  ASSERT_EQ(2U, run.arcs.size());
  EXPECT_EQ("lllls", run.arcs[0].mode.Word(5));
  EXPECT_EQ("lllll", run.arcs[1].mode.Word(5));
  EXPECT_NEAR(0.03163, run.arcs[0].t_end, 1e-5);
  ContactDynamics dynamics(*robot, robot->nominal().u);
  int on_cone = 0;
  for (const Arc& arc : run.arcs) {
    for (int k = 1; k < 1000; ++k) {
      const double t = arc.t_begin + k * 1e-3 * (arc.t_end - arc.t_begin);
      dynamics.Evaluate(run.State(t), arc.mode);
      const Vector& force = dynamics.force();
      for (int i = 0; i < 5; ++i) {
        const Friction& friction = robot->friction()[i];
        const double room = friction.coefficient * force(i) - force.segment<2>(friction.row).norm();
        EXPECT_GE(room, -1e-9) << i << " at " << t;
        on_cone += i == kFinger && arc.mode.Sticking().Contains(i) && room < 1e-9;
      }
    }
  }
  EXPECT_GT(on_cone, 3);  // it creeps
  ConstraintTerms terms;
  double slip = 0;
  for (const double part : {0.1, 0.5, 1.0}) {
    const Arc& arc = run.arcs[1];
    const Vector x = run.State(arc.t_begin + part * (arc.t_end - arc.t_begin));
    robot->Constraints(x.head(8), x.tail(7), &terms);
    const Vector rate = terms.jacobian * x.tail(7);
    const double now = rate.segment<2>(robot->friction()[kFinger].row).norm();
    EXPECT_GT(now, slip);
    slip = now;
  }
}

/// In the plane, with corners in one order or the other.
std::unique_ptr<RobotSystem> TippingBox(bool reversed) {
  const std::string urdf =
      BoxAndFinger(kTippingBox, R"(type="planar"><origin xyz="0 0 0.1156"/><axis xyz="0 1 0"/>)",
                   "0.917567", "-0.1036 0 0.0749");
  const std::string near = R"(
  near: {kind: plane, link: box, point: [-0.0914, 0, -0.0843], friction: 0.632})";
  const std::string far = R"(
  far: {kind: plane, link: box, point: [0.0914, 0, -0.0843], friction: 0.632})";
  const std::string finger = R"(
  finger: {kind: link_plane, link: finger, radius: 0.01, friction: 0.632,
           other_link: box, other_point: [-0.0914, 0, 0], normal: [-1, 0, 0]})";
  const std::string contacts = reversed ? finger + far + near : near + far + finger;
  return MakeRobot({urdf, "base: fixed\nconstraints:" + contacts + R"(
efforts:
  press: {kind: actuator, joint: finger, input: force}
  damper: {kind: joint_spring, joint: finger, damping: 3.76}
nominal: {inputs: {force: 17.76}}
)"});
}

/// The far corner falls on the ground and the box lies, all rates across the ground are zero but
/// for rounding of either sign: the near corner goes on to carry, in any order of the contacts.
TEST(PushedBox, LiesOnTheCornersThatAnImpactLeavesAtRest) {
  Vector x(8);
  x << -0.008002547997169316, 0.031274565341442455, -0.0002783142645032162, -0.005799928691349801,
      0.23439360696945613, 0.2539930640911833, 2.779631174372718, 0.2082021271975682;
  for (int k = 0; k < 30; ++k) {
    std::vector<Vector> ends;
    for (const bool reversed : {false, true}) {
      const auto robot = TippingBox(reversed);
      SimulateOptions options;
      options.relative_tolerance = options.absolute_tolerance = 1e-12;
      const Trajectory run = Simulate(*robot, x, robot->nominal().u, 0.01, options);
      ASSERT_TRUE(run.status.ok()) << k << ": " << run.status.message;
      const int near = reversed ? 2 : 0;
      EXPECT_TRUE(run.arcs.back().mode.Contains(near)) << k;
      ContactDynamics dynamics(*robot, robot->nominal().u);
      dynamics.Evaluate(run.FinalState(), run.arcs.back().mode);
      EXPECT_GT(dynamics.force()(near), 1) << k;
      ends.push_back(run.FinalState());
    }
    EXPECT_LT((ends[0] - ends[1]).cwiseAbs().maxCoeff(), 1e-10) << k;
    x.tail(4) *= 1.003;
  }
}

}  // namespace
}  // namespace contact_flow
