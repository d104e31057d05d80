// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>

namespace contact_flow {
namespace example {

/// What soft_biped and hopping_trot share: a rigid body (x, z, pitch) and two point feet (x, z) in
/// the vertical plane, ground at z = 0, so M is constant and diagonal and a(q) = (z_left, z_right).
struct PointFootBiped {
  static constexpr int kDof = 7, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 7> kCoordinates = {
      "body_x",      "left_foot_x",  "right_foot_x", "body_z",
      "left_foot_z", "right_foot_z", "body_pitch"};
  static constexpr std::array<const char*, 7> kUnits = {"m", "m", "m", "m", "m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  /// Indices of the coordinates; leg 0 is left, 1 is right.
  static constexpr int kBodyX = 0, kFootX = 1, kBodyZ = 3, kFootZ = 4, kPitch = 6;

  template <class P, class S>
  static void MassMatrix(const P& p, const Eigen::Matrix<S, 7, 1>&, Eigen::Matrix<S, 7, 7>* M) {
    for (int i = 0; i < 7; ++i) {
      for (int j = 0; j < 7; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(kBodyX, kBodyX) = (*M)(kBodyZ, kBodyZ) = S(p.body_mass);
    for (int leg = 0; leg < 2; ++leg) {
      (*M)(kFootX + leg, kFootX + leg) = (*M)(kFootZ + leg, kFootZ + leg) = S(p.foot_mass);
    }
    (*M)(kPitch, kPitch) = S(p.body_inertia);
  }

  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 7, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(kFootZ);
    (*a)(1) = q(kFootZ + 1);
  }

  template <class P>
  static auto Restitution(const P&, int) {
    return 0;
  }
};

}  // namespace example
}  // namespace contact_flow
