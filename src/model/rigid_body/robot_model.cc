// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/rigid_body/robot_model.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "contact_flow/model/rigid_body/mass_matrix.h"
#include "contact_flow/nearest_name.h"
#include "tree_factor.h"

namespace contact_flow {

const std::vector<std::string>& RobotBaseNames() {
  static const std::vector<std::string> names = {"fixed", "planar", "floating"};
  return names;
}

Mat3<double> AxisFrame(const Vec3<double>& axis) {
  // The coordinate axis most across, so that the cross products are long.
  int across = 0;
  for (int k = 1; k < 3; ++k) {
    if (std::abs(axis(k)) < std::abs(axis(across))) across = k;
  }
  Mat3<double> frame;
  frame.col(2) = axis;
  const Vec3<double> helper = Vec3<double>::Unit(across);
  frame.col(0) = (helper - axis(across) * axis).normalized();
  frame.col(1) = Cross<double>(frame.col(2), frame.col(0));
  return frame;
}

const RobotModel::Link& RobotModel::FindLink(const std::string& link) const {
  std::vector<std::string> names;
  for (const Link& candidate : links) {
    if (candidate.name == link) return candidate;
    names.push_back(candidate.name);
  }
  throw std::invalid_argument(UnknownName("link", link, names));
}

RobotModel::Coordinate RobotModel::FindCoordinate(const std::string& coordinate) const {
  std::vector<std::string> names;
  for (const RigidBodyTree::Body& body : tree.bodies()) {
    const bool clocked = clock >= 0 && &body == &tree.bodies()[clock];
    if (body.joint == JointKind::kBall || clocked) continue;
    for (int k = 0; k < body.num_dofs; ++k) {
      const std::string& name = coordinates[body.q + k];
      if (name == coordinate) return {body.q + k, body.v + k};
      names.push_back(name);
    }
  }
  if (std::find(held.begin(), held.end(), coordinate) != held.end()) {
    throw std::invalid_argument("joint '" + coordinate +
                                "' moves no mass and is held at zero: give what it carries an "
                                "<inertial> in the URDF");
  }
  throw std::invalid_argument(UnknownName("joint", coordinate, names));
}

RobotModel::Coordinate RobotModel::ClockCoordinate() const {
  if (clock < 0) throw std::invalid_argument("the robot has no clock");
  return {tree.bodies()[clock].q, tree.bodies()[clock].v};
}

void RobotModel::AddClock() {
  if (clock >= 0) return;
  if (std::find(coordinates.begin(), coordinates.end(), "clock") != coordinates.end()) {
    throw std::invalid_argument(
        "a joint is called 'clock', as the time that references need: "
        "rename it in the URDF");
  }
  clock = AddPrismatic({-1, Pose()}, "clock", Vec3<double>::UnitX()).body;  // level: weightless
  units.back() = "s";
  JoinInertias();
}

void RobotModel::JoinInertias() {
  for (int i = 0; i < tree.num_bodies(); ++i) {
    BodyInertia sum;
    if (i == clock) sum.mass = 1;
    for (const Link& link : links) {
      if (link.body == i) sum = sum + link.inertia.In(link.pose);
    }
    tree.SetInertia(i, sum);
  }
}

void RobotModel::CheckMass() const {
  const int n = tree.dof();
  if (n == 0) throw std::invalid_argument("nothing moves: there is no joint but fixed ones");
  double total = 0;
  for (const RigidBodyTree::Body& body : tree.bodies()) total += body.inertia.mass;
  if (!(total > 0)) {
    throw std::invalid_argument(
        "what moves has no mass: the links have no <inertial>, or one of "
        "mass zero; give them one");
  }
  TreeState<double> state(tree);
  Matrix mass(n, n);
  int massless = -1;
  // At rest, and at a few postures without symmetry: singular at all of them is
  // singular by structure.
  for (int sample = 0; sample < 4; ++sample) {
    Vector q = tree.Neutral();
    for (int k = 0; k < q.size(); ++k) q(k) += sample * std::sin(1.0 + 2.3 * k + 0.7 * sample);
    UpdatePositions(tree, q.data(), &state);
    UpdateInertias(tree, &state);
    MassMatrix(tree, &state, mass.data());
    massless = TreeFactor(tree).Compute(&mass);
    if (massless < 0) return;
  }
  const std::string name = "'" + velocities[massless] + "'";
  const int body = tree.dof_body(massless);
  if (tree.bodies()[body].inertia.mass > 0 || velocities[massless].compare(0, 5, "base_") != 0) {
    throw std::invalid_argument(name +
                                " moves no mass that other joints do not move alike: the "
                                "mass matrix is singular; give what it carries an <inertial>");
  }
  throw std::invalid_argument(name +
                              " moves no mass that other joints do not move alike: the mass "
                              "matrix is singular; give the root link an <inertial>, or fix it "
                              "(base: fixed)");
}

RobotModel::Mount RobotModel::AddRevolute(const Mount& parent, const std::string& joint,
                                          const Vec3<double>& axis, bool endless) {
  const Pose turned{AxisFrame(axis), Vec3<double>::Zero()};
  const int body = tree.AddBody(parent.body, JointKind::kRevolute, parent.pose * turned);
  coordinates.push_back(joint);
  velocities.push_back(joint);
  units.push_back("rad");
  circle.push_back(endless);
  return {body, turned.Inverse()};
}

RobotModel::Mount RobotModel::AddPrismatic(const Mount& parent, const std::string& joint,
                                           const Vec3<double>& axis) {
  const Pose turned{AxisFrame(axis), Vec3<double>::Zero()};
  const int body = tree.AddBody(parent.body, JointKind::kPrismatic, parent.pose * turned);
  coordinates.push_back(joint);
  velocities.push_back(joint);
  units.push_back("m");
  circle.push_back(false);
  return {body, turned.Inverse()};
}

RobotModel::Mount RobotModel::AddPlanar(const Mount& parent, const std::string& joint,
                                        const Vec3<double>& first, const Vec3<double>& second,
                                        const Vec3<double>& axis,
                                        const std::vector<std::string>& suffixes) {
  const Mount slid = AddPrismatic(parent, joint + suffixes[0], first);
  const Mount placed = AddPrismatic(slid, joint + suffixes[1], second);
  return AddRevolute(placed, joint + suffixes[2], axis, true);
}

RobotModel::Mount RobotModel::AddFloating(const Mount& parent, const std::string& joint) {
  const int slid = tree.AddBody(parent.body, JointKind::kTranslation, parent.pose);
  const int body = tree.AddBody(slid, JointKind::kBall, Pose());
  for (const char* suffix : {"_x", "_y", "_z"}) {
    coordinates.push_back(joint + suffix);
    velocities.push_back(joint + suffix);
    units.push_back("m");
  }
  for (const char* suffix : {"_qw", "_qx", "_qy", "_qz"}) {
    coordinates.push_back(joint + suffix);
    units.push_back("");
  }
  for (const char* suffix : {"_wx", "_wy", "_wz"}) velocities.push_back(joint + suffix);
  circle.insert(circle.end(), {false, false});
  return {body, Pose()};
}

}  // namespace contact_flow
