// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/rigid_body/rigid_body_tree.h"

namespace contact_flow {

/// How the root link of a robot is held.
enum class RobotBase {
  kFixed,     ///< in the world
  kPlanar,    ///< moves in the vertical x–z plane: base_x, base_z [m], base_pitch about y [rad]
  kFloating,  ///< free: base_x, base_y, base_z [m] and the unit quaternion base_qw … base_qz
};
/// "fixed", "planar", "floating".
const std::vector<std::string>& RobotBaseNames();

/// A RigidBodyTree with the names a person uses for its parts.
struct RobotModel {
  struct Link {
    std::string name;
    int body;             ///< that it is rigidly part of, −1 for the world
    Pose pose;            ///< of the link's frame in the body's frame (in the world's for −1)
    BodyInertia inertia;  ///< of this link alone, in the link's frame
  };
  /// A position that is a line or a circle, with its rate.
  struct Coordinate {
    int q, v;
  };
  /// A shape of a link's collision geometry.
  struct Shape {
    enum class Kind {
      kBox,       ///< size: its edges
      kSphere,    ///< size: radius, –, –
      kCylinder,  ///< about z; size: radius, length, –
      kCapsule,   ///< a cylinder about z with half spheres at its ends; size as of a cylinder
      kMesh,      ///< size: factors of the file's x, y, z
    };
    int link;   ///< index in `links`
    Pose pose;  ///< in the link's frame
    Kind kind;
    Vec3<double> size;  ///< [m]
    std::string mesh;   ///< file of a mesh, as the URDF writes it
    int line;           ///< of the URDF
  };
  /// What the URDF says of a joint of one freedom, beyond its geometry.
  struct JointTraits {
    std::string name;
    bool limited = false;
    double lower = 0, upper = 0;       ///< [rad] or [m]
    double effort = 0, speed = 0;      ///< largest, 0 where the URDF says nothing
    double damping = 0, friction = 0;  ///< [N·s/m] or [N·m·s/rad], [N] or [N·m]
  };
  /// A joint that follows another: q = multiplier · q_master + offset.
  struct Mimic {
    std::string joint, master;
    double multiplier, offset;
  };

  std::string name;
  RigidBodyTree tree;
  std::vector<Link> links;               ///< parents first
  std::vector<std::string> coordinates;  ///< [nq]
  std::vector<std::string> units;        ///< [nq] "m", "rad" or "" in a quaternion
  std::vector<std::string> velocities;   ///< [nv]
  std::vector<bool> circle;              ///< [bodies] turns without end
  std::vector<std::string> warnings;     ///< what of the description is not used, or was repaired
  std::vector<Shape> shapes;             ///< collision geometry, in the order of the file
  std::vector<JointTraits> traits;       ///< of the joints with one freedom
  std::vector<Mimic> mimics;
  /// Body of the clock: a coordinate `clock` [s] whose rate is 1 [s/s] and which nothing pushes;
  /// −1 where there is none.
  int clock = -1;
  /// Joints that move no mass, and are held at zero.
  std::vector<std::string> held;

  /// These throw std::invalid_argument with the nearest name for one that does not exist.
  const Link& FindLink(const std::string& link) const;
  Coordinate FindCoordinate(const std::string& coordinate) const;

  /// The clock's; throws std::invalid_argument where there is none.
  Coordinate ClockCoordinate() const;
  /// Adds a clock, behind all that there is. Throws std::invalid_argument where a coordinate is
  /// called so.
  void AddClock();

  /// Sets the inertia of every body from those of its links.
  void JoinInertias();
  /// Throws std::invalid_argument, naming a coordinate that moves no mass, when M is singular
  /// wherever it is looked at.
  void CheckMass() const;

  /// These add a joint whose frame is `pose` in the frame of `parent`, its numbers called after
  /// `joint`, and return the pose and body of what it carries, at rest in the joint frame.
  struct Mount {
    int body;
    Pose pose;
  };
  Mount AddRevolute(const Mount& parent, const std::string& joint, const Vec3<double>& axis,
                    bool endless);
  Mount AddPrismatic(const Mount& parent, const std::string& joint, const Vec3<double>& axis);
  /// `suffixes` are of the two directions of the plane and the angle about `axis`.
  Mount AddPlanar(const Mount& parent, const std::string& joint, const Vec3<double>& first,
                  const Vec3<double>& second, const Vec3<double>& axis,
                  const std::vector<std::string>& suffixes);
  Mount AddFloating(const Mount& parent, const std::string& joint);
};

/// A rotation whose third column is the unit vector `axis`; without rounding along coordinate axes.
Mat3<double> AxisFrame(const Vec3<double>& axis);

}  // namespace contact_flow
