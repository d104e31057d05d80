// SPDX-License-Identifier: BSD-3-Clause
// Small robots with collision geometry, and where they are.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>

#include "contact_flow/io/robot_file.h"
#include "test/refusal.h"

namespace contact_flow {
namespace test {

inline constexpr char kInertial[] =
    "<inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" "
    "iyz=\"0\"/></inertial>";
inline constexpr char kOrigin[] = "<origin xyz=\"0.1 -0.2 0.3\" rpy=\"0.4 0.5 0.6\"/>";

inline std::string Collision(const std::string& geometry, const std::string& origin = kOrigin) {
  return "<collision>" + origin + "<geometry>" + geometry + "</geometry></collision>";
}
inline std::string UnitLink(const std::string& name, const std::string& content) {
  return "<link name=\"" + name + "\">" + kInertial + content + "</link>";
}
inline std::string UnboundRobot(const std::string& content) {
  return "<robot name=\"r\">" + content + "</robot>";
}

inline RobotDescription Parse(const std::string& content, const std::string& yaml,
                              const std::string& folder = "") {
  return ParseRobot(UnboundRobot(content), YAML::Load(yaml), folder);
}
inline std::string GeometryRefusal(const std::string& content, const std::string& yaml) {
  return RefusalOf([&] { Parse(content, yaml); });
}
inline bool Warns(const RobotDescription& robot, const std::string& words) {
  for (const std::string& warning : robot.model.warnings) {
    if (warning.find(words) != std::string::npos) return true;
  }
  return false;
}

/// The pose of `kOrigin` in a link at a random place, as (rotation, position) in the world.
struct Placed {
  Vector q = Vector::Zero(7);
  Mat3<double> rotation;
  Vec3<double> centre;

  explicit Placed(std::mt19937* generator) {
    std::normal_distribution<double> normal;
    for (int k = 0; k < 7; ++k) q(k) = normal(*generator);
    q.tail<4>().normalize();
    const Eigen::Quaterniond body(q(3), q(4), q(5), q(6));
    const Mat3<double> origin = (Eigen::AngleAxisd(0.6, Vec3<double>::UnitZ()) *
                                 Eigen::AngleAxisd(0.5, Vec3<double>::UnitY()) *
                                 Eigen::AngleAxisd(0.4, Vec3<double>::UnitX()))
                                    .toRotationMatrix();
    rotation = body.toRotationMatrix() * origin;
    centre = q.head<3>() + body.toRotationMatrix() * Vec3<double>(0.1, -0.2, 0.3);
  }
};

inline double LowestGap(const RobotSystem& system, const Vector& q) {
  ConstraintTerms terms;
  system.Constraints(q, Vector::Zero(system.dof()), &terms);
  return terms.gap.minCoeff();
}

}  // namespace test
}  // namespace contact_flow
