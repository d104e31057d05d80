// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <memory>
#include <sstream>
#include <string>

#include "contact_flow/io/robot_file.h"

namespace contact_flow {
namespace test {

/// Robots that are the template systems of test/friction/systems, made of URDF and YAML.

inline std::string Link(const std::string& name, double mass, double ixx, double iyy, double izz) {
  const auto text = [](double value) {
    std::ostringstream out;
    out.precision(17);
    out << value;
    return out.str();
  };
  std::string link = "<link name=\"" + name + "\">";
  if (mass > 0) {
    link += "<inertial><mass value=\"" + text(mass) + "\"/><inertia ixx=\"" + text(ixx) +
            "\" iyy=\"" + text(iyy) + "\" izz=\"" + text(izz) +
            "\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
  }
  return link + "</link>\n";
}

inline std::string Slide(const std::string& name, const std::string& parent,
                         const std::string& child, const std::string& axis) {
  return "<joint name=\"" + name + "\" type=\"prismatic\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><axis xyz=\"" + axis +
         "\"/><limit lower=\"-100\" upper=\"100\" effort=\"1\" velocity=\"1\"/></joint>\n";
}

/// A mass on slides from the link "world": coordinates name_x, name_y, name_z.
inline std::string OnSlides(const std::string& name, double mass) {
  return Link(name + "x", 0, 0, 0, 0) + Link(name + "y", 0, 0, 0, 0) + Link(name, mass, 1, 1, 1) +
         Slide(name + "_x", "world", name + "x", "1 0 0") +
         Slide(name + "_y", name + "x", name + "y", "0 1 0") +
         Slide(name + "_z", name + "y", name, "0 0 1");
}

inline std::unique_ptr<RobotSystem> Robot(const std::string& urdf, const std::string& yaml) {
  RobotTexts texts;
  texts.urdf = urdf;
  texts.yaml = yaml;
  return MakeRobot(texts);
}

/// systems/rod.h with mass 1 and half length 0.5, its pitch the rod's theta.
inline std::unique_ptr<RobotSystem> RodRobot(double friction) {
  const double inertia = 0.25 / 3;
  const std::string mu = std::to_string(friction);
  return Robot(
      "<robot name=\"rod\">" + Link("rod", 1, inertia, inertia, 1e-2) + "</robot>",
      "base: planar\ngravity: 9.81\nconstraints:\n"
      "  foot: {kind: plane, link: rod, point: [0, 0, -0.5], friction: " +
          mu +
          "}\n"
          "  head: {kind: plane, link: rod, point: [0, 0, 0.5], friction: " +
          mu +
          "}\n"
          "parameters: {mu0: foot/friction, mass: links/rod/mass, inertia: links/rod/iyy}\n"
          "nominal: {positions: {base_z: 0.6}}");
}

/// systems/block.h without its clock, on rails along and across the incline.
inline std::unique_ptr<RobotSystem> InclineRobot(double incline, double friction) {
  std::ostringstream along, across, yaml;
  for (std::ostringstream* out : {&along, &across, &yaml}) out->precision(17);
  along << std::cos(incline) << " 0 " << -std::sin(incline);
  across << std::sin(incline) << " 0 " << std::cos(incline);
  yaml << "gravity: 9.81\nconstraints:\n  floor: {kind: plane, link: block, normal: ["
       << std::sin(incline) << ", 0, " << std::cos(incline) << "], friction: " << friction
       << "}\nparameters: {mu0: floor/friction, mass: links/block/mass}";
  return Robot("<robot name=\"block\">" + Link("ground", 0, 0, 0, 0) +
                   Link("carriage", 0, 0, 0, 0) + Link("block", 1, 0.1, 0.1, 0.1) +
                   Slide("x", "ground", "carriage", along.str()) +
                   Slide("z", "carriage", "block", across.str()) + "</robot>",
               yaml.str());
}

/// systems/puck.h on three rails, with drag and a force.
inline std::unique_ptr<RobotSystem> PuckRobot(double friction, double restitution, double drag,
                                              double force_x, double force_y) {
  std::ostringstream yaml;
  yaml.precision(17);
  yaml << "gravity: 9.81\nconstraints:\n  floor: {kind: plane, link: puck, friction: " << friction
       << ", restitution: " << restitution
       << "}\nefforts:\n  drag: {kind: drag, link: puck, linear: " << drag << "}\n"
       << "  push: {kind: constant_force, link: puck, force: [" << force_x << ", " << force_y
       << ", 0]}\nparameters: {mu0: floor/friction, mass: links/puck/mass}";
  return Robot("<robot name=\"puck\">" + Link("ground", 0, 0, 0, 0) + Link("first", 0, 0, 0, 0) +
                   Link("second", 0, 0, 0, 0) + Link("puck", 1, 0.1, 0.1, 0.1) +
                   Slide("x", "ground", "first", "1 0 0") + Slide("y", "first", "second", "0 1 0") +
                   Slide("z", "second", "puck", "0 0 1") + "</robot>",
               yaml.str());
}

/// systems/ball.h with mass 1 and radius 0.1, free in space.
inline std::unique_ptr<RobotSystem> BallRobot(double friction, double restitution) {
  std::ostringstream yaml;
  yaml << "base: floating\ngravity: 9.81\nconstraints:\n  floor: {kind: plane, link: ball, offset: "
       << "-0.1, radius: 0.1, friction: " << friction << ", restitution: " << restitution
       << "}\nparameters: {mu0: floor/friction, mass: links/ball/mass, ixx: links/ball/ixx, "
       << "iyy: links/ball/iyy, izz: links/ball/izz}\nnominal: {positions: {base_z: 1}}";
  return Robot("<robot name=\"ball\">" + Link("ball", 1, 0.004, 0.004, 0.004) + "</robot>",
               yaml.str());
}

}  // namespace test
}  // namespace contact_flow
