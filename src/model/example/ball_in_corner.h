// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A unit point mass between a floor y ≥ 0 and a wall x ≥ 0 that meet at a right angle.
struct BallInCorner {
  static constexpr const char* kName = "ball_in_corner";
  static constexpr const char* kSummary =
      "a ball bouncing off floor and wall, orthogonal and elastic, both at once";
  static constexpr int kDof = 2, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "y"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "wall"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P gravity = 9.81, restitution = 0.7;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
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
    (*f)(0) = S(0.0);
    (*f)(1) = S(-p.gravity);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = q(0);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown from 1 m height so that it meets floor and wall at once (at any positive gravity).
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::sqrt;
    const double fall = p.gravity > 0 ? sqrt(2 / p.gravity) : 1;
    NominalRun run;
    run.x.resize(4);
    run.x << 2 * fall, 1, -2, 0;
    run.u = Vector::Zero(0);
    run.duration = 1;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
