// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A uniform rod of length 2 l that slides and falls on a floor: its centre (x, z) and the angle θ
/// of its head from the vertical. Foot and head may touch:
///   a = z ∓ l cos θ,   slip = ẋ ∓ l cos θ θ̇.
/// A foot that is pushed into its slide may find no contact forces, or several (Painlevé), for
/// μ > 4/3.
struct SlidingRod {
  static constexpr const char* kName = "sliding_rod";
  static constexpr const char* kSummary =
      "uniform rod whose foot sticks and slips while it falls; Painleve's example";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "theta"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"foot", "head"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, half_length = 0.5, gravity = 9.81, friction = 0.3, restitution = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the rod", Range::kPositive);
      visit(half_length, "half_length", "m", "half of its length", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(friction, "friction", "", "coefficient of friction of the ends", Range::kNonNegative);
      visit(restitution, "restitution", "", "restitution of the ends", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(2, 2) = S(p.mass * p.half_length * p.half_length / 3.0);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(2) = S(0.0);
    (*f)(1) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    (*a)(0) = q(1) - p.half_length * cos(q(2));
    (*a)(1) = q(1) + p.half_length * cos(q(2));
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    using std::cos;
    (*s)(0) = v(0) - p.half_length * cos(q(2)) * v(2);
    (*s)(1) = v(0) + p.half_length * cos(q(2)) * v(2);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Let go on its foot, 0.2 rad from the vertical; ends before the head lands.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::cos;
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(1) = p.half_length * cos(0.2);
    run.x(2) = 0.2;
    run.u = Vector::Zero(0);
    run.duration = 0.5;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
