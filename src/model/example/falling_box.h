// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A free rigid box over a floor that its 8 corners may touch: configurations in SE(3) (Sec. 6.1),
/// the centre in world axes and a unit quaternion, velocities of the centre and angular velocity in
/// body axes.
struct FallingBox {
  static constexpr const char* kName = "falling_box";
  static constexpr const char* kSummary =
      "free rigid box in space that falls on its corners; orientation by a unit quaternion";
  static constexpr int kDof = 6, kPositions = 7, kConstraints = 8, kInputs = 6;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 7> kCoordinates = {"x",  "y",  "z", "qw",
                                                              "qx", "qy", "qz"};
  static constexpr std::array<const char*, 7> kUnits = {"m", "m", "m", "", "", "", ""};
  static constexpr std::array<const char*, 6> kVelocities = {"x", "y", "z", "roll", "pitch", "yaw"};
  static constexpr std::array<const char*, 8> kConstraintNames = {
      "corner_000", "corner_100", "corner_010", "corner_110",
      "corner_001", "corner_101", "corner_011", "corner_111"};
  static constexpr std::array<const char*, 6> kInputNames = {"force_x",  "force_y",  "force_z",
                                                             "torque_x", "torque_y", "torque_z"};

  static ConfigurationSpace Space() {
    ConfigurationSpace space(3);
    return space.Append(ConfigurationSpace::Factor::kRotation);
  }

  template <class P>
  struct Parameters {
    P mass = 1, length = 0.4, width = 0.3, height = 0.2, gravity = 9.81, restitution = 0.5;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass, evenly distributed", Range::kPositive);
      visit(length, "length", "m", "along the body's x axis", Range::kPositive);
      visit(width, "width", "m", "along the body's y axis", Range::kPositive);
      visit(height, "height", "m", "along the body's z axis", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(restitution, "restitution", "", "restitution of every corner", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
    }
    const P x = p.length * p.length, y = p.width * p.width, z = p.height * p.height;
    for (int i = 0; i < 3; ++i) (*M)(i, i) = S(p.mass);
    (*M)(3, 3) = S(p.mass * (y + z) / 12.0);
    (*M)(4, 4) = S(p.mass * (x + z) / 12.0);
    (*M)(5, 5) = S(p.mass * (x + y) / 12.0);
  }

  /// Gravity, and the inputs: a force at the centre in world axes, a torque in body axes.
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>&,
                    const Eigen::Matrix<S, 6, 1>&, const Eigen::Matrix<S, 6, 1>& u,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int k = 0; k < 6; ++k) (*f)(k) = u(k);
    (*f)(2) -= S(p.mass * p.gravity);
  }

  /// Heights of the corners; bit k of a corner's number says on which side of axis k it is.
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>& q,
                   Eigen::Matrix<S, 8, 1>* a) {
    const S &w = q(3), &x = q(4), &y = q(5), &z = q(6);
    const S up_x = (x * z - w * y) * p.length, up_y = (y * z + w * x) * p.width;
    const S up_z = 0.5 * (w * w - x * x - y * y + z * z) * p.height;
    for (int corner = 0; corner < 8; ++corner) {
      S gap = q(2);
      gap += corner & 1 ? up_x : -up_x;
      gap += corner & 2 ? up_y : -up_y;
      gap += corner & 4 ? up_z : -up_z;
      (*a)(corner) = gap;
    }
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Dropped tilted and spinning; three corners bounce, one after the other.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(13);
    run.x << 0, 0, 1, std::cos(0.4), std::sin(0.4) * 0.6, std::sin(0.4) * 0.8, 0,  //
        0.2, -0.1, 0, 0.5, -0.3, 0.4;
    run.u = Vector::Zero(6);
    run.duration = 0.55;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
