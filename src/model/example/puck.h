// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A point mass on a floor in space, with a gyroscopic force and drag.
struct Puck {
  static constexpr const char* kName = "puck";
  static constexpr const char* kSummary =
      "puck that slides on a floor with friction in space, and stops";
  static constexpr int kDof = 3, kConstraints = 1, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "z"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, force_x = 0, force_y = 0, gyroscopic = 0, drag = 0, friction = 0.3;
    P restitution = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the puck", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(force_x, "force_x", "N", "constant force", Range::kAny);
      visit(force_y, "force_y", "N", "constant force", Range::kAny);
      visit(gyroscopic, "gyroscopic", "N s/m", "force across the velocity, per speed", Range::kAny);
      visit(drag, "drag", "N s/m", "force against the velocity, per speed", Range::kAny);
      visit(friction, "friction", "", "coefficient of friction of the floor", Range::kNonNegative);
      visit(restitution, "restitution", "", "restitution of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = i == j ? S(p.mass) : S(0.0);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = S(p.force_x) - p.gyroscopic * v(1) - p.drag * v(0);
    (*f)(1) = S(p.force_y) + p.gyroscopic * v(0) - p.drag * v(1);
    (*f)(2) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Slides from the origin, and stops.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(3) = 1;
    run.x(4) = 0.5;
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
