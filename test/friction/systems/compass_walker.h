// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// A compass walker, each foot with its own row of stepping stones; q = (hip_x,
/// hip_z, left, right).
struct CompassWalker {
  static constexpr const char* kName = "compass_walker";
  static constexpr const char* kSummary = "compass walker on stones";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = false, kAffineConstraints = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"hip_x", "hip_z", "left_leg",
                                                              "right_leg"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "rad", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P hip_mass = 1000, leg_mass = 1, leg_inertia = 0, leg_length = 1, leg_centre = 1, gravity = 1,
      slope = 0.009, stone_left = 0, stone_right = 0, pitch = 0.4, depth = 1;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(hip_mass, "hip_mass", "kg", "", Range::kPositive);
      visit(leg_mass, "leg_mass", "kg", "", Range::kPositive);
      visit(leg_inertia, "leg_inertia", "kg m^2", "", Range::kNonNegative);
      visit(leg_length, "leg_length", "m", "", Range::kPositive);
      visit(leg_centre, "leg_centre", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(slope, "slope", "rad", "", Range::kAny);
      visit(stone_left, "stone_left", "m", "", Range::kAny);
      visit(stone_right, "stone_right", "m", "", Range::kAny);
      visit(pitch, "pitch", "m", "", Range::kPositive);
      visit(depth, "depth", "m", "", Range::kNonNegative);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                         Eigen::Matrix<S, 4, 4>* M) {
    using std::cos;
    using std::sin;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.hip_mass + 2.0 * p.leg_mass);
    for (int i = 2; i < 4; ++i) {
      (*M)(i, i) = S(p.leg_mass * p.leg_centre * p.leg_centre + p.leg_inertia);
      (*M)(0, i) = (*M)(i, 0) = p.leg_mass * p.leg_centre * cos(q(i));
      (*M)(1, i) = (*M)(i, 1) = p.leg_mass * p.leg_centre * sin(q(i));
    }
  }
  /// Without Coriolis terms, which follow from M.
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    using std::cos;
    using std::sin;
    const P gx = p.gravity * sin(p.slope), gz = -1.0 * p.gravity * cos(p.slope);
    const P mass = p.hip_mass + 2.0 * p.leg_mass;
    (*f)(0) = S(mass * gx);
    (*f)(1) = S(mass * gz);
    for (int i = 2; i < 4; ++i) {
      (*f)(i) = p.leg_mass * p.leg_centre * (gx * cos(q(i)) + gz * sin(q(i)));
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    for (int i = 0; i < 2; ++i) {
      const S x = q(0) + p.leg_length * sin(q(2 + i));
      const P stone = i == 0 ? p.stone_left : p.stone_right;
      const S y = 0.5 * (1.0 - cos(M_PI * (x - stone) / p.pitch));
      S pit = S(0.0);
      if (y > S(0.25)) {
        const S deep = y - 0.25;
        pit = p.depth * deep * deep * deep * deep;
      }
      (*a)(i) = q(1) - p.leg_length * cos(q(2 + i)) + pit;
    }
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   const Eigen::Matrix<S, 4, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    using std::cos;
    for (int i = 0; i < 2; ++i) (*s)(i) = v(0) + p.leg_length * cos(q(2 + i)) * v(2 + i);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.Mu(i);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.Gamma(i);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(8);
    run.x(1) = p.leg_length;
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
