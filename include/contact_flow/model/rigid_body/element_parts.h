// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/height_grid.h"
#include "contact_flow/model/parameter_values.h"
#include "contact_flow/model/rigid_body/robot_model.h"
#include "contact_flow/model/time_function.h"

namespace contact_flow {

/// A point fixed in a body of a RigidBodyTree (in the world for −1).
struct AttachedPoint {
  int body = -1;
  Vec3<double> local = Vec3<double>::Zero();  ///< in the frame of the body [m]
  int link = -1;  ///< that it was given by, in RobotModel::links; −1: none
};

/// What a constraint or an effort element of a robot is attached to, and its numbers. Elements see
/// the robot as z = (positions of the points in world axes, values of the joints, turns) [3P+J+3T]:
/// of turns, only the rates, angular velocities of bodies in world axes, mean anything.
struct ElementParts {
  std::string name;
  std::string where;                           ///< " (line 7)" of the YAML that it is from, or ""
  std::vector<AttachedPoint> points;           ///< [P]
  std::vector<RobotModel::Coordinate> joints;  ///< [J]
  std::vector<int> turns;                      ///< [T] bodies, −1 the world
  std::vector<int> inputs;                     ///< indices into u
  std::vector<Parameter> numbers;
  std::vector<Range> ranges;  ///< of the numbers
  /// Of an effort that follows a function of time, whose last joint is the robot's clock; or null.
  std::shared_ptr<const TimeFunction> reference;
  /// Heights of the terrain that a constraint touches, or null.
  std::shared_ptr<const HeightGrid> heights;
  /// The robot's constraints that are the reference's switches, in the order of time.
  std::vector<int> switches;

  int size() const { return static_cast<int>(3 * (points.size() + turns.size()) + joints.size()); }
};

/// Where an element finds its fields, by key. Each call appends to the parts that are being filled;
/// what is missing or wrong throws std::invalid_argument that names it.
class ElementFields {
 public:
  /// Default of a number that must be given.
  static constexpr double kRequired = std::numeric_limits<double>::quiet_NaN();

  virtual ~ElementFields() = default;
  /// A point: its link and its coordinates in the link's frame, the origin unless given.
  virtual void Point(const std::string& link_key, const std::string& point_key) = 0;
  /// One more point, at the tip of a unit vector from the last one and fixed in the same link: the
  /// direction of the field (default `otherwise`), in the link's frame.
  virtual void TipOf(const std::string& direction_key, const Vec3<double>& otherwise) = 0;
  /// One more point, at this unit vector from the last one and fixed in the same link.
  virtual void Tip(const Vec3<double>& direction) = 0;
  virtual void Joint(const std::string& key) = 0;
  /// A function of time, and the robot's clock as one more joint.
  virtual void Reference(const std::string& key) = 0;
  /// Heights on a grid, by several keys.
  virtual void Heights() = 0;
  virtual void Input(const std::string& key) = 0;
  virtual void Number(const std::string& key, double otherwise, const char* unit,
                      const char* meaning, Range range) = 0;
  /// The three numbers of an effort that saturates, by default beyond everything: the largest one,
  /// the speed at which none is left, and the one at standstill, `limit` unless given.
  void Limits() {
    Number("limit", kUnlimited, "N or N m", "largest effort, either way", Range::kPositive);
    Number("speed", kUnlimited, "m/s or rad/s", "at which no effort is left", Range::kPositive);
    Number("stall", kUnlimited, "N or N m", "effort at standstill", Range::kPositive);
  }
  static constexpr double kUnlimited = 1e100;
  /// The numbers of a proportional-derivative controller.
  void Gains() {
    Number("stiffness", kRequired, "N/m or N m/rad", "proportional gain", Range::kNonNegative);
    Number("damping", 0, "N s/m or N m s/rad", "derivative gain", Range::kNonNegative);
    Limits();
  }
  /// Three numbers, key_x, key_y, key_z.
  virtual void Vector(const std::string& key, const Vec3<double>& otherwise, const char* unit,
                      const char* meaning) = 0;
};

}  // namespace contact_flow
