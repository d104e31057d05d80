// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/model/rigid_body/element_parts.h"
#include "contact_flow/model/rigid_body/inverse_dynamics.h"

namespace contact_flow {

/// z, ż and z̈ of an element.
struct ElementMotion {
  static constexpr int kMaxSize = 18;
  double z[kMaxSize];
  double rate[kMaxSize];
  double acceleration[kMaxSize];
};

/// How the spatial velocity and acceleration of a body change with η_j and v_j.
template <class S>
struct BodyColumns {
  Spatial<S> velocity_q;
  Spatial<S> acceleration_q;
  Spatial<S> acceleration_v;
};

/// How z, ż and z̈ change with the robot's motion: matrices [N×c] over the c velocity numbers that
/// move z (ElementGeometry::columns).
struct ElementRows {
  Matrix z_q;                                ///< ∂z/∂η = ∂ż/∂v
  Matrix rate_q;                             ///< ∂ż/∂η
  Matrix acceleration_q;                     ///< ∂z̈/∂η at fixed v̇
  Matrix acceleration_v;                     ///< ∂z̈/∂v at fixed v̇
  std::vector<BodyColumns<double>> of_body;  ///< of the body last looked at, by its movers

  /// Makes room for the largest element.
  explicit ElementRows(const RigidBodyTree& tree);
};

/// Where the points and joints of an element are, how they move, and how its bodies turn.
class ElementGeometry {
 public:
  ElementGeometry(const RigidBodyTree& tree, const ElementParts& parts);

  int size() const { return size_; }
  /// Velocity numbers that move z, ascending.
  const std::vector<int>& columns() const { return columns_; }
  /// z is affine in q: nothing that turns moves a point.
  bool IsAffine() const { return affine_; }

  /// z, after UpdatePositions.
  void Place(const TreeState<double>& state, const double* q, ElementMotion* motion) const;
  /// ż, after Place and UpdateVelocities.
  void Move(const TreeState<double>& state, const double* v, ElementMotion* motion) const;
  /// z̈ at v̇ (null: zero), after Move and UpdateAccelerations with this gravity.
  void Accelerate(const TreeState<double>& state, const Vec3<double>& gravity, const double* vdot,
                  ElementMotion* motion) const;
  /// ∂z/∂η, after Place.
  void Columns(const TreeState<double>& state, const ElementMotion& motion,
               ElementRows* rows) const;
  /// All of `rows`, after Accelerate.
  void Differentiate(const RigidBodyTree& tree, const TreeState<double>& state,
                     const Vec3<double>& gravity, const ElementMotion& motion,
                     ElementRows* rows) const;
  /// Adds the generalized force of e [N], after Place: forces on bodies, efforts on joints [nv].
  void Push(const TreeState<double>& state, const ElementMotion& motion, const double* e,
            PointForces<double>* external, double* effort) const;

 private:
  struct Mover {
    int dof;
    int column;
  };
  struct Point {
    AttachedPoint place;
    std::vector<Mover> movers;
  };
  struct Joint {
    RobotModel::Coordinate place;
    int column;
  };

  struct Turn {
    int body;
    std::vector<Mover> movers;
  };

  int size_;
  bool affine_ = true;
  std::vector<Point> points_;
  std::vector<Joint> joints_;
  std::vector<Turn> turns_;
  std::vector<int> columns_;
};

}  // namespace contact_flow
