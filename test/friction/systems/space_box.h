// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

/// A uniform box in space with four corners over a floor, and a clock w: its centre in world axes,
/// a unit quaternion, angular velocity in body axes. It is pushed by (u_x + rate_x w, u_y + rate_y
/// w), at the height `arm` above the floor where it stands, and turned about the vertical by u_t.
struct SpaceBox {
  static constexpr const char* kName = "space_box";
  static constexpr const char* kSummary = "a box on four corners, with friction";
  static constexpr int kDof = 7, kPositions = 8, kConstraints = 4, kInputs = 3;
  static constexpr int kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 8> kCoordinates = {"x",  "y",  "z",  "qw",
                                                              "qx", "qy", "qz", "clock"};
  static constexpr std::array<const char*, 8> kUnits = {"m", "m", "m", "", "", "", "", "s"};
  static constexpr std::array<const char*, 7> kVelocities = {"x",     "y",   "z",    "roll",
                                                             "pitch", "yaw", "clock"};
  static constexpr std::array<const char*, 4> kConstraintNames = {"back_right", "front_right",
                                                                  "back_left", "front_left"};
  static constexpr std::array<const char*, 3> kInputNames = {"push_x", "push_y", "turn"};

  static ConfigurationSpace Space() {
    ConfigurationSpace space(3);
    space.Append(ConfigurationSpace::Factor::kRotation);
    return space.Append(ConfigurationSpace::Factor::kLine);
  }

  template <class P>
  struct Parameters {
    P mass = 2, length = 0.5, width = 0.4, height = 1, gravity = 9.81, arm = 0.8;
    P rate_x = 0, rate_y = 0, friction = 0.8, restitution = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(length, "length", "m", "along x", Range::kPositive);
      visit(width, "width", "m", "along y", Range::kPositive);
      visit(height, "height", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(arm, "arm", "m", "", Range::kAny);
      visit(rate_x, "rate_x", "N/s", "", Range::kAny);
      visit(rate_y, "rate_y", "N/s", "", Range::kAny);
      visit(friction, "friction", "", "negative: no slip", Range::kAny);
      visit(restitution, "restitution", "", "", Range::kUnitInterval);
    }
  };
  template <class S>
  using Quantities = Eigen::Matrix<S, 7, 1>;
  template <class S>
  using Positions = Eigen::Matrix<S, 8, 1>;
  template <class S>
  using Three = Eigen::Matrix<S, 3, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Positions<S>&, Eigen::Matrix<S, 7, 7>* M) {
    for (int i = 0; i < 7; ++i) {
      for (int j = 0; j < 7; ++j) (*M)(i, j) = S(0.0);
    }
    const P x = p.length * p.length, y = p.width * p.width, z = p.height * p.height;
    for (int i = 0; i < 3; ++i) (*M)(i, i) = S(p.mass);
    (*M)(3, 3) = S(p.mass * (y + z) / 12.0);
    (*M)(4, 4) = S(p.mass * (x + z) / 12.0);
    (*M)(5, 5) = S(p.mass * (x + y) / 12.0);
    (*M)(6, 6) = S(p.mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Positions<S>& q, const Quantities<S>&,
                    const Eigen::Matrix<S, 3, 1>& u, Quantities<S>* f) {
    const S push_x = p.rate_x * q(7) + u(0), push_y = p.rate_y * q(7) + u(1);
    const P above = p.arm - 0.5 * p.height;
    (*f)(0) = push_x;
    (*f)(1) = push_y;
    (*f)(2) = S(-p.mass * p.gravity);
    const S torque[3] = {-(above * push_y), above * push_x, u(2)};
    for (int i = 0; i < 3; ++i) {
      const Three<S> axis = Axis(q, i);
      (*f)(3 + i) = axis(0) * torque[0] + axis(1) * torque[1] + axis(2) * torque[2];
    }
    (*f)(6) = S(0.0);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Positions<S>& q, Eigen::Matrix<S, 4, 1>* a) {
    const S x = Axis(q, 0)(2), y = Axis(q, 1)(2), z = Axis(q, 2)(2);
    for (int i = 0; i < 4; ++i) {
      S gap = q(2) - (0.5 * p.height) * z;
      gap += ((i & 1) != 0 ? 0.5 : -0.5) * p.length * x;
      gap += ((i & 2) != 0 ? 0.5 : -0.5) * p.width * y;
      (*a)(i) = gap;
    }
  }

  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Positions<S>& q, const Quantities<S>& v,
                   Eigen::Matrix<S, 8, 1>* s) {
    const Three<S> axis[3] = {Axis(q, 0), Axis(q, 1), Axis(q, 2)};
    for (int i = 0; i < 4; ++i) {
      const P r[3] = {((i & 1) != 0 ? 0.5 : -0.5) * p.length, ((i & 2) != 0 ? 0.5 : -0.5) * p.width,
                      -0.5 * p.height};
      const S turn[3] = {v(4) * r[2] - v(5) * r[1], v(5) * r[0] - v(3) * r[2],
                         v(3) * r[1] - v(4) * r[0]};
      for (int k = 0; k < 2; ++k) {
        S slip = v(k);
        for (int j = 0; j < 3; ++j) slip += axis[j](k) * turn[j];
        (*s)(2 * i + k) = slip;
      }
    }
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction < P(0.0) ? P(contact_flow::Friction::kNoSlip) : p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(15);
    run.x(2) = 0.5 * p.height;
    run.x(3) = run.x(14) = 1;
    run.u = Vector::Zero(3);
    return run;
  }

  /// Column i of the rotation matrix: the body's axis in world axes.
  template <class S>
  static Three<S> Axis(const Positions<S>& q, int i) {
    const S &w = q(3), &x = q(4), &y = q(5), &z = q(6);
    Three<S> axis;
    if (i == 0) {
      axis(0) = w * w + x * x - y * y - z * z;
      axis(1) = 2.0 * (x * y + w * z);
      axis(2) = 2.0 * (x * z - w * y);
    } else if (i == 1) {
      axis(0) = 2.0 * (x * y - w * z);
      axis(1) = w * w - x * x + y * y - z * z;
      axis(2) = 2.0 * (y * z + w * x);
    } else {
      axis(0) = 2.0 * (x * z + w * y);
      axis(1) = 2.0 * (y * z - w * x);
      axis(2) = w * w - x * x - y * y + z * z;
    }
    return axis;
  }
};

}  // namespace test
}  // namespace contact_flow
