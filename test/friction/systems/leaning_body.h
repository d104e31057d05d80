// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/test_models.h"

namespace contact_flow {
namespace test {

/// A body of 2 kg in the plane with a point on a floor and one on a wall that leans by a little.
struct LeaningBody : UnitMasses<3, 2> {
  static constexpr double kMass = 2, kInertia = 0.023, kLean = 0.01;
  static constexpr const char* kName = "leaning_body";
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "angle"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "wall"};
  static constexpr int kSlipDimension = 1;
  template <class P>
  struct Parameters {
    P floor_x = 0, floor_z = 0, wall_x = 0, wall_z = 0, floor_friction = 1, wall_friction = 1;
    P restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(floor_x, "floor_x", "m", "of the point on the floor", Range::kAny);
      visit(floor_z, "floor_z", "m", "of the point on the floor", Range::kAny);
      visit(wall_x, "wall_x", "m", "of the point on the wall", Range::kAny);
      visit(wall_z, "wall_z", "m", "of the point on the wall", Range::kAny);
      visit(floor_friction, "floor_friction", "", "of the floor", Range::kNonNegative);
      visit(wall_friction, "wall_friction", "", "of the wall", Range::kNonNegative);
      visit(restitution, "restitution", "", "of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const P&, const Eigen::Matrix<S, 3, 1>&, Eigen::Matrix<S, 3, 3>* M) {
    M->setConstant(S(0.0));
    (*M)(0, 0) = (*M)(1, 1) = S(kMass);
    (*M)(2, 2) = S(kInertia);
  }
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    f->setConstant(S(0.0));
  }
  /// A point of the body, with its velocity where v is one.
  template <class P, class S>
  static Eigen::Matrix<S, 2, 1> At(P x, P z, const Eigen::Matrix<S, 3, 1>& q) {
    using std::cos;
    using std::sin;
    return {q(0) + cos(q(2)) * S(x) - sin(q(2)) * S(z), q(1) + sin(q(2)) * S(x) + cos(q(2)) * S(z)};
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    const Eigen::Matrix<S, 2, 1> wall = At(p.wall_x, p.wall_z, q);
    (*a)(0) = At(p.floor_x, p.floor_z, q)(1);
    (*a)(1) = wall(0) + S(kLean) * wall(1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    const Eigen::Matrix<S, 2, 1> floor = At(p.floor_x, p.floor_z, q);
    const Eigen::Matrix<S, 2, 1> wall = At(p.wall_x, p.wall_z, q);
    (*s)(0) = v(0) - (floor(1) - q(1)) * v(2);
    (*s)(1) = v(1) + (wall(0) - q(0)) * v(2) - S(kLean) * (v(0) - (wall(1) - q(1)) * v(2));
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return i == 0 ? p.floor_friction : p.wall_friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.restitution : P(0);
  }
};

}  // namespace test
}  // namespace contact_flow
