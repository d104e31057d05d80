// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A unit point mass in a corner of any angle: floor y ≥ 0 and wall x sin α + y cos α ≥ 0, whose
/// inward normals make the angle α (the corner opens by π − α), so that G_ij = cos α. With α < π/2
/// the wall's impact pushes the ball off the floor; with α > π/2 it pushes into it. At the default,
/// α = 2π/3 and plastic, outcomes are continuous and piecewise differentiable although the
/// constraints are not orthogonal; at α > π/2 with restitution, or at α < π/2, the order of
/// impacts decides.
struct Corner {
  static constexpr const char* kName = "corner";
  static constexpr const char* kSummary =
      "a ball in a corner of any angle; obtuse normals and no restitution: continuous, not "
      "orthogonal";
  static constexpr int kDof = 2, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "wall"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P angle = 2.0943951023931957, gravity_x = 2, gravity_y = -9.81, restitution = 0;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(angle, "angle", "rad", "angle between the inward normals of floor and wall; below pi",
            Range::kPositive);
      visit(gravity_x, "gravity_x", "m/s^2", "acceleration along the floor", Range::kAny);
      visit(gravity_y, "gravity_y", "m/s^2", "acceleration off the floor", Range::kAny);
      visit(restitution, "restitution", "", "restitution of floor and wall", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                         Eigen::Matrix<S, 2, 2>* M) {
    (*M)(0, 0) = (*M)(1, 1) = S(1.0);
    (*M)(0, 1) = (*M)(1, 0) = S(0.0);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(p.gravity_x);
    (*f)(1) = S(p.gravity_y);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    const P c = cos(p.angle), s = sin(p.angle);
    (*a)(0) = q(1);
    (*a)(1) = s * q(0) + c * q(1);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown from 1 m away, on the bisector, so that it meets floor and wall at once after 0.2 s.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::cos;
    using std::sin;
    constexpr double kFlight = 0.2;
    const double x = sin(p.angle / 2), y = cos(p.angle / 2);
    NominalRun run;
    run.x.resize(4);
    run.x << x, y, -x / kFlight - p.gravity_x * kFlight / 2,
        -y / kFlight - p.gravity_y * kFlight / 2;
    run.u = Vector::Zero(0);
    run.duration = 0.4;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
