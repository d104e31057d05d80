// SPDX-License-Identifier: BSD-3-Clause
// Symmetries of return maps that are none, although nothing differs at the state of the return.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "contact_flow/analysis/orbit_sizes.h"
#include "contact_flow/analysis/poincare.h"
#include "contact_flow/io/robot_file.h"
#include "test/adversary/rescaled_system.h"

namespace contact_flow {
namespace {

std::string Link(const std::string& name, const std::string& height) {
  return "<link name=\"" + name + "\"><inertial><origin xyz=\"0 0 " + height +
         "\"/><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" "
         "iyz=\"0\" izz=\"0.01\"/></inertial></link>";
}

std::string Hinge(const std::string& name, const std::string& child) {
  return "<joint name=\"" + name + "\" type=\"continuous\"><parent link=\"frame\"/><child link=\"" +
         child + "\"/><axis xyz=\"0 1 0\"/></joint>";
}

/// Two pendulums on one axle, each with its spring and damper.
std::unique_ptr<RobotSystem> Pendulums(const std::string& height, const std::string& left,
                                       const std::string& right) {
  RobotTexts texts;
  texts.urdf = "<robot name=\"pendulums\"><link name=\"frame\"/>" + Link("one", height) +
               Link("other", height) + Hinge("left", "one") + Hinge("right", "other") + "</robot>";
  texts.yaml = "efforts: {l: {kind: joint_spring, joint: left, " + left +
               "}, r: {kind: joint_spring, joint: right, " + right + "}}";
  return MakeRobot(texts);
}

/// A ball that bounces without loss on waves, base_x, base_z and base_pitch.
std::unique_ptr<RobotSystem> BallOnWaves() {
  RobotTexts texts;
  texts.urdf = "<robot name=\"ball\">" + Link("ball", "0") + "</robot>";
  texts.yaml =
      "{base: planar, constraints: {floor: {kind: height_field, link: ball, amplitude: 0.05, "
      "wave_x: 3, restitution: 1}}}";
  return MakeRobot(texts);
}

PoincareReturn ReturnOf(const MechanicalSystem& system, const Section& section, const Vector& x) {
  return PoincareMap(system, Vector::Zero(0), section).Return(x);
}

void ExpectRefused(const PoincareReturn& one) {
  EXPECT_EQ(ReturnStatus::kRefused, one.status);
  EXPECT_NE(std::string::npos, one.message.find("symmetry is none of the system")) << one.message;
}

/// Upright they fall; with the angles set aside as travelled the rates alone would contract.
TEST(SymmetryCheck, AnglesOfPendulumsDoNotTravel) {
  const std::string damped = "stiffness: 0, damping: 3";
  const auto upright = Pendulums("0.3", damped, damped);
  Section section = Section::After(1);
  section.symmetry.Travel(*upright, {"left", "right"});
  ExpectRefused(ReturnOf(*upright, section, Vector::Zero(4)));
}

/// At rest springs exert nothing, whatever their stiffness.
TEST(SymmetryCheck, UnequalSpringsDoNotChangePlaces) {
  const std::string soft = "stiffness: 2, damping: 0.1", hard = "stiffness: 20, damping: 0.1";
  const auto equal = Pendulums("-0.3", soft, soft), unequal = Pendulums("-0.3", soft, hard);
  Section section = Section::After(1);
  section.symmetry.Exchange(*equal, "left", "right");
  const PoincareReturn one = ReturnOf(*equal, section, Vector::Zero(4));
  EXPECT_EQ(ReturnStatus::kReturned, one.status) << one.message;
  ExpectRefused(ReturnOf(*unequal, section, Vector::Zero(4)));
}

/// In flight nothing of the floor is felt.
TEST(SymmetryCheck, WavesAreNotTheSameFurtherOn) {
  const auto ball = BallOnWaves();
  Section section = Section::Apex(*ball, "base_z");
  section.symmetry.Travel(*ball, {"base_x"});
  Vector x = Vector::Zero(6);
  x(0) = M_PI / 6;  // a crest
  x(1) = 0.5;
  ExpectRefused(ReturnOf(*ball, section, x));
  x(0) = 0.1;
  ExpectRefused(ReturnOf(*ball, section, x));
}

/// The ball comes down on every crest in turn; half a wave further there is none. In units in which
/// lengths are small numbers, too.
TEST(SymmetryCheck, TheNextReturnIsCompared) {
  const auto ball = BallOnWaves();
  const double wave = 2 * M_PI / 3, height = 0.45, fall = std::sqrt(2 * height / 9.81);
  for (const double length : {1.0, 1e-6}) {
    adversary::Units units = adversary::Units::Same(3, 1);
    units.length.head(2) *= length;
    units.gap *= length;
    const adversary::RescaledSystem system(*ball, units);
    PoincareOptions options;
    options.simulate = units.Scale(options.simulate);
    for (const double crests : {1.0, 1.5}) {
      SCOPED_TRACE(testing::Message() << "length " << length << ", " << crests << " crests");
      Section section = Section::Apex(system, "base_z");
      section.symmetry.Shift(system, "base_x", -crests * wave * length);
      Vector x = Vector::Zero(6);
      x(0) = M_PI / 6 - crests * wave / 2;
      x(1) = 0.5;
      x(3) = crests * wave / (2 * fall);
      const PoincareReturn one =
          PoincareMap(system, Vector::Zero(0), section, options).Return(units.State(x));
      ASSERT_LE((units.Back(one.x) - x).cwiseAbs().maxCoeff(), 1e-8);
      if (crests > 1) {
        ExpectRefused(one);
      } else {
        EXPECT_EQ(ReturnStatus::kReturned, one.status) << one.message;
      }
    }
  }
}

/// A ball that bounces without loss on a level tread returns further on, but its second bounce is
/// on the next tread where the first one ends before; nothing at the first return tells.
TEST(SymmetryCheck, TranslationEndsWhereTheTreadDoes) {
  const double height = 0.45, speed = 1, way = speed * 2 * std::sqrt(2 * height / 9.81);
  Matrix along = Matrix::Zero(6, 2);
  along(0, 0) = along(3, 1) = 1;
  Vector x = Vector::Zero(6);
  x(1) = height;
  x(3) = speed;
  for (const bool ends : {false, true}) {
    SCOPED_TRACE(ends ? "the tread ends" : "the tread goes on");
    RobotTexts texts;
    texts.urdf = "<robot name=\"ball\">" + Link("ball", "0") + "</robot>";
    texts.yaml =
        "{base: planar, constraints: {floor: {kind: stairs, link: ball, point: [0, 0, 0], rise: "
        "0.1, run: 5, riser: 0.02, direction: [1, 0, 0], first: " +
        std::to_string((ends ? 1.2 : 2.2) * way) + ", last: 50, restitution: 1}}}";
    const auto ball = MakeRobot(texts);
    const PoincareMap map(*ball, Vector::Zero(0), Section::Apex(*ball, "base_z"), {});
    const PoincareReturn one = map.Return(x);
    ASSERT_EQ(ReturnStatus::kReturned, one.status) << one.message;
    ASSERT_NEAR(way, one.x(0), 1e-9);
    EXPECT_LE(OffOrbit(*ball, x, one, along), 1e-9);
    const std::string differs = NextReturnDiffers(*ball, map, x, one, along);
    EXPECT_EQ(ends, !differs.empty()) << differs;
  }
}

}  // namespace
}  // namespace contact_flow
