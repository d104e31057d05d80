// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sstream>
#include <string>

#include "contact_flow/io/robot_file.h"

namespace contact_flow {

inline std::string Inertial(double mass, double inertia) {
  std::ostringstream text;
  text << "<inertial><mass value=\"" << mass << "\"/><inertia ixx=\"" << inertia
       << "\" ixy=\"0\" ixz=\"0\" iyy=\"" << inertia << "\" iyz=\"0\" izz=\"" << inertia
       << "\"/></inertial>";
  return text.str();
}

inline std::string Link(const std::string& name, double mass, double inertia) {
  return "<link name=\"" + name + "\">" + Inertial(mass, inertia) + "</link>\n";
}

inline std::string Joint(const std::string& name, const std::string& type,
                         const std::string& parent, const std::string& child,
                         const std::string& origin, const std::string& axis) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><origin xyz=\"" + origin + "\"/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/></joint>\n";
}

/// A planar body on n legs, each of two prismatic joints with springs, whose feet land at once:
/// 2n+3 degrees of freedom, n ≤ 64 contacts.
inline RobotTexts Legs(int n, double restitution = 0) {
  const std::string name = "legs" + std::to_string(n);
  std::string urdf = "<robot name=\"" + name + "\">\n" + Link("body", 5, 0.3), contacts, efforts;
  for (int i = 0; i < n; ++i) {
    const std::string k = std::to_string(i);
    std::ostringstream place;
    place << (n > 1 ? -1 + 2.0 * i / (n - 1) : 0) << " 0 0";
    urdf += Link("s" + k, 0.001, 1e-6) + Link("f" + k, 0.4, 1e-6);
    urdf += Joint("x" + k, "prismatic", "body", "s" + k, place.str(), "1 0 0");
    urdf += Joint("z" + k, "prismatic", "s" + k, "f" + k, "0 0 -0.5", "0 0 1");
    contacts += "  foot" + k + ": {kind: plane, link: f" + k +
                ", point: [0, 0, 0], restitution: " + std::to_string(restitution) + "}\n";
    efforts += "  kz" + k + ": {kind: joint_spring, joint: z" + k +
               ", stiffness: " + std::to_string(200 + 10 * i) + ", damping: 2}\n" + "  kx" + k +
               ": {kind: joint_spring, joint: x" + k + ", stiffness: 200, damping: 2}\n";
  }
  RobotTexts texts;
  texts.urdf = urdf + "</robot>\n";
  texts.yaml = "base: planar\nconstraints:\n" + contacts + "efforts:\n" + efforts +
               "nominal:\n  positions: {base_z: 0.8}\n  duration: 0.4\n";
  texts.path = name;
  return texts;
}

/// Links on hinges along y, with springs: `branching` of them on each, so that 1 makes a chain.
inline RobotTexts Links(int dof, int branching) {
  const std::string name = "links" + std::to_string(dof);
  std::string urdf = "<robot name=\"" + name + "\">\n<link name=\"l0\"/>\n", efforts;
  for (int i = 1; i <= dof; ++i) {
    const std::string k = std::to_string(i), parent = "l" + std::to_string((i - 1) / branching);
    urdf += Link("l" + k, 0.5, 1e-3);
    urdf += Joint("j" + k, "revolute", parent, "l" + k, "0 0 -0.1", "0 1 0");
    efforts += "  d" + k + ": {kind: joint_spring, joint: j" + k + ", stiffness: 2, damping: 1}\n";
  }
  RobotTexts texts;
  texts.urdf = urdf + "</robot>\n";
  texts.yaml = "base: fixed\nefforts:\n" + efforts;
  texts.path = name;
  return texts;
}

}  // namespace contact_flow
