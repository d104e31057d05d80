// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/rigid_body/spatial.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// Where a frame is: x_outer = rotation · x_inner + position.
struct Pose {
  Mat3<double> rotation = Mat3<double>::Identity();
  Vec3<double> position = Vec3<double>::Zero();  ///< [m]

  Pose operator*(const Pose& inner) const {
    return {rotation * inner.rotation, rotation * inner.position + position};
  }
  Vec3<double> operator*(const Vec3<double>& point) const { return rotation * point + position; }
  Pose Inverse() const { return {rotation.transpose(), -(rotation.transpose() * position)}; }
};

/// Mass [kg], centre of mass [m] and inertia about it [kg·m²], in the axes of one frame.
struct BodyInertia {
  double mass = 0;
  Vec3<double> com = Vec3<double>::Zero();
  Mat3<double> central = Mat3<double>::Zero();

  /// The same body seen from a frame in which the present one has this pose.
  BodyInertia In(const Pose& pose) const;
  /// Both bodies, rigidly joined.
  BodyInertia operator+(const BodyInertia& other) const;
};

/// How a body moves against its parent. The joint frame is fixed in the parent; the body's frame
/// coincides with it at rest.
enum class JointKind {
  kRevolute,     ///< turns about z by q [rad]: one number
  kPrismatic,    ///< slides along z by q [m]: one number
  kTranslation,  ///< slides freely: three numbers, along the axes of the joint frame [m]
  kBall,  ///< turns freely: q a unit quaternion (w, x, y, z), v the angular velocity in body axes
};

/// A mechanism of rigid bodies without loops, in the sense of Featherstone (2008), Ch. 4: constant,
/// shared between threads; what changes with a state is in a TreeState. Bodies are numbered so that
/// a parent comes before its children; −1 is the world. Rigidly joined bodies are one body. Joints
/// with several freedoms that are not above are chains of bodies, all but the last without mass: a
/// free body is a kTranslation and a kBall, so that v = (velocity of its origin in world axes,
/// angular velocity in body axes).
class RigidBodyTree {
 public:
  /// Most velocity numbers of a tree.
  static constexpr int kMaxDof = 256;

  struct Body {
    int parent;
    JointKind joint;
    Pose placement;  ///< of the joint frame in the parent's frame
    BodyInertia inertia;
    int q, v;  ///< first position and velocity index
    int num_dofs;
    int last_dof;  ///< of this body
    /// First body with mass of its branch from the world (the branch's first if there is none):
    /// the branch's spatial vectors are taken about its origin, so that a robot loses no digits
    /// far from the world's origin, nor beside another mechanism that is far away.
    int reference;
  };

  /// Returns the index of the new body; its numbers come after those there are. Throws
  /// std::invalid_argument for a parent that does not exist and beyond kMaxDof.
  int AddBody(int parent, JointKind joint, const Pose& placement, const BodyInertia& inertia = {});
  /// Joins `inertia` rigidly to a body, or to the world, where it has no effect.
  void AddInertia(int body, const BodyInertia& inertia);
  void SetInertia(int body, const BodyInertia& inertia);

  const std::vector<Body>& bodies() const { return bodies_; }
  int num_bodies() const { return static_cast<int>(bodies_.size()); }
  int num_positions() const { return num_positions_; }
  int dof() const { return static_cast<int>(dof_parent_.size()); }
  /// Body that a velocity number belongs to.
  int dof_body(int j) const { return dof_body_[j]; }
  /// The next number towards the root, −1 at the root: M(i, j) = 0 unless one is on the other's way
  /// to the root.
  int dof_parent(int j) const { return dof_parent_[j]; }
  /// Last velocity number that moves a body, −1 for the world and what is fixed to it.
  int last_dof(int body) const { return body < 0 ? -1 : bodies_[body].last_dof; }
  /// Gravitational acceleration in world axes [m/s²].
  const Vec3<double>& gravity() const { return gravity_; }
  void set_gravity(const Vec3<double>& gravity) { gravity_ = gravity; }

  /// Positions of all bodies with every joint at zero [nq].
  Vector Neutral() const;
  /// Whether M is the same at every q, by a sufficient condition: above a body that turns nothing
  /// turns, it carries nothing, and its centre of mass is on its axis.
  bool HasConstantMass() const;

 private:
  void ChooseReferences();

  std::vector<Body> bodies_;
  std::vector<int> dof_body_;
  std::vector<int> dof_parent_;
  int num_positions_ = 0;
  Vec3<double> gravity_ = Vec3<double>::Zero();
};

}  // namespace contact_flow
