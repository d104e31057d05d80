// SPDX-License-Identifier: BSD-3-Clause
// A body slides upright on one foot, with friction, and bumps into a wall with its head. The impact
// neither presses the foot nor lifts it where the body is upright; it presses it for one sign of
// the pitch and lifts it for the other, and then the weight brings it back at once.
#include <gtest/gtest.h>

#include <cmath>

#include "contact_flow/derivative/b_derivative.h"
#include "contact_flow/flow/simulate.h"
#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace {

constexpr double kFootHeight = 0.3, kSpeed = 1, kPlace = 0.19, kDuration = 0.05;

std::unique_ptr<RobotSystem> MakeBody() {
  RobotTexts texts;
  texts.urdf =
      "<robot name=\"body\"><link name=\"body\"><inertial><mass value=\"1\"/><inertia ixx=\"0.05\" "
      "ixy=\"0\" ixz=\"0\" iyy=\"0.05\" iyz=\"0\" izz=\"0.05\"/></inertial></link></robot>";
  texts.yaml =
      "base: planar\nconstraints:\n"
      "  foot: {kind: plane, link: body, point: [0, 0, -0.3], offset: -0.3, friction: 0.05}\n"
      "  head: {kind: plane, link: body, point: [0.1, 0, 0.2], normal: [-1, 0, 0], offset: -0.3, "
      "restitution: 0.4}\n";
  return MakeRobot(texts);
}

/// On the foot, with this pitch.
Vector Standing(double pitch) {
  Vector x(6);
  x << kPlace, kFootHeight * (std::cos(pitch) - 1), pitch, kSpeed, 0, 0;
  return x;
}

Trajectory SlideToWall(const RobotSystem& body, const Vector& x) {
  SimulateOptions options;
  options.relative_tolerance = options.absolute_tolerance = 1e-11;
  return Simulate(body, x, InputSchedule::Constant(Vector(0)), kDuration, options);
}

double PitchAtWall(const RobotSystem& body, double pitch) {
  return SlideToWall(body, Standing(pitch)).transitions.front().x_minus(2);
}

/// The pitch of the beginning with which the body is upright at the wall.
double UprightPitch(const RobotSystem& body) {
  double before = 0, pitch = 1e-4;
  double left = PitchAtWall(body, before), now = PitchAtWall(body, pitch);
  for (int k = 0; k < 8 && now != left && now != 0; ++k) {
    const double next = pitch - now * (pitch - before) / (now - left);
    before = pitch;
    left = now;
    pitch = next;
    now = PitchAtWall(body, pitch);
  }
  return pitch;
}

TEST(BrushedFoot, IsPressedOrComesBackByItsWeight) {
  const std::unique_ptr<RobotSystem> body = MakeBody();
  const Vector x = Standing(UprightPitch(*body));
  const Trajectory run = SlideToWall(*body, x);
  ASSERT_TRUE(run.status.ok()) << run.status.message;
  ASSERT_EQ(run.transitions.size(), 1u);
  EXPECT_LE(std::abs(run.transitions.front().impulse(0)), 1e-9);
  const BDerivative B = DifferentiateOutcome(*body, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  // Rises below some 1e-6 m/s are made rest: steps are larger.
  for (const int entry : {2, 5}) {
    for (const double sign : {1, -1}) {
      Vector w = Vector::Zero(6);
      w(entry) = sign;
      w = ProjectAdmissible(*body, x, B.initial_mode, w);
      double last = 0;
      for (const double step : {entry == 2 ? 3e-4 : 3e-2, entry == 2 ? 1e-4 : 1e-2}) {
        Vector moved = body->Perturb(x, step * w);
        const Vector v = moved.tail(3);
        const double z = kFootHeight * (std::cos(moved(2)) - 1);  // the foot stays on the floor
        moved(1) = z;
        moved(4) = -kFootHeight * std::sin(moved(2)) * v(2);
        const Vector quotient = (SlideToWall(*body, moved).FinalState() - run.FinalState()) / step;
        const double off = (quotient - B(w)).cwiseAbs().maxCoeff();
        EXPECT_LE(off, 20 * step) << "entry " << entry << ", sign " << sign << ", step " << step;
        if (last > 0) {
          EXPECT_LE(off, 0.5 * last);
        }
        last = off;
      }
    }
  }
}

/// Pressed by less than what decides, and by more: the friction of such a push is felt by the head,
/// so that runs which lift the foot have another derivative.
TEST(BrushedFoot, HasTwoDerivativesBesideUpright) {
  const std::unique_ptr<RobotSystem> body = MakeBody();
  const double upright = UprightPitch(*body);
  for (const double off : {1e-8, -1e-8, 1e-7, 1e-6}) {
    const BDerivative B = DifferentiateOutcome(*body, SlideToWall(*body, Standing(upright + off)));
    EXPECT_FALSE(B.status.ok()) << off;
    EXPECT_NE(std::string::npos, B.status.message.find("two derivatives")) << B.status.message;
  }
  const Vector x = Standing(upright + 1e-5);
  const Trajectory run = SlideToWall(*body, x);
  const BDerivative B = DifferentiateOutcome(*body, run);
  ASSERT_TRUE(B.status.ok()) << B.status.message;
  const Vector w = ProjectAdmissible(*body, x, B.initial_mode, Vector::Unit(6, 2));
  for (const double step : {1e-6, -1e-6}) {
    Vector moved = Standing(upright + 1e-5 + step);
    moved.tail(3) += (x + step * w - moved).tail(3);
    const Vector quotient = (SlideToWall(*body, moved).FinalState() - run.FinalState()) / step;
    EXPECT_LE((quotient - B(w)).cwiseAbs().maxCoeff(), 1e-3) << step;
  }
}

}  // namespace
}  // namespace contact_flow
