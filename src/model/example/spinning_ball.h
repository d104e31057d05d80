// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A homogeneous ball over a floor in space; (rx, ry, rz) are the integrals of its angular
/// velocity, of which nothing depends. The point that touches moves with
///   slip = (ẋ − r ω_y, ẏ + r ω_x),
/// which is the gradient of no function: what rolls does not slip.
struct SpinningBall {
  static constexpr const char* kName = "spinning_ball";
  static constexpr const char* kSummary =
      "ball in space that bounces with spin on a floor with friction, slides and rolls";
  static constexpr int kDof = 6, kConstraints = 1, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {"x", "y", "z", "rx", "ry", "rz"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "rad", "rad", "rad"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters {
    P mass = 1, radius = 0.1, gravity = 9.81, force_x = 0, force_y = 0, friction = 0.3;
    P restitution = 0.6;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the ball", Range::kPositive);
      visit(radius, "radius", "m", "radius of the ball", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(force_x, "force_x", "N", "force at its centre", Range::kAny);
      visit(force_y, "force_y", "N", "force at its centre", Range::kAny);
      visit(friction, "friction", "", "coefficient of friction of the floor", Range::kNonNegative);
      visit(restitution, "restitution", "", "restitution of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 3 ? S(p.mass) : S(0.4 * p.mass * p.radius * p.radius);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                    const Eigen::Matrix<S, 6, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 3; i < 6; ++i) (*f)(i) = S(0.0);
    (*f)(0) = S(p.force_x);
    (*f)(1) = S(p.force_y);
    (*f)(2) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0) - p.radius * v(4);
    (*s)(1) = v(1) + p.radius * v(3);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown along x with back spin, from 0.3 m; three bounces.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(12);
    run.x(2) = 0.3;
    run.x(6) = 1;
    run.x(10) = -30;
    run.u = Vector::Zero(0);
    run.duration = 0.8;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
