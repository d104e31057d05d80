// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"
#include "point_foot_biped.h"

namespace contact_flow {
namespace example {

/// The rigid-leg trot of rigid_biped.h a second time: the coordinates of body and feet, the feet
/// held at (∓hip_offset, −leg_length) of the body frame by bilateral constraints b(q) = 0
/// (Sec. 6.1).
struct JointedBiped : PointFootBiped {
  static constexpr const char* kName = "jointed_biped";
  static constexpr const char* kSummary =
      "rigid_biped in the coordinates of body and feet, its legs bilateral constraints";
  static constexpr bool kAffineConstraints = false;
  static constexpr int kBilateral = 4;
  static constexpr std::array<const char*, 4> kBilateralNames = {"left_leg_x", "left_leg_z",
                                                                 "right_leg_x", "right_leg_z"};

  template <class P>
  struct Parameters {
    P body_mass = 1, foot_mass = 1, body_inertia = 1, gravity = 1, leg_length = 0.5,
      hip_offset = 0.25;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(body_mass, "body_mass", "kg", "mass of the body", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each foot", Range::kPositive);
      visit(body_inertia, "body_inertia", "kg m^2", "inertia of the body about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "length of a leg", Range::kNonNegative);
      visit(hip_offset, "hip_offset", "m", "distance from body centre to hip", Range::kNonNegative);
    }
  };

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>&,
                    const Eigen::Matrix<S, 7, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 7, 1>* f) {
    for (int k = 0; k < 7; ++k) (*f)(k) = S(0.0);
    (*f)(kBodyZ) = S(-p.body_mass * p.gravity);
    for (int leg = 0; leg < 2; ++leg) (*f)(kFootZ + leg) = S(-p.foot_mass * p.gravity);
  }

  template <class P, class S>
  static void Closures(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>& q,
                       Eigen::Matrix<S, 4, 1>* b) {
    using std::cos;
    using std::sin;
    const S c = cos(q(kPitch)), s = sin(q(kPitch));
    for (int leg = 0; leg < 2; ++leg) {
      const P offset = leg == 0 ? P(-p.hip_offset) : p.hip_offset;
      (*b)(2 * leg) = q(kFootX + leg) - q(kBodyX) - offset * c - p.leg_length * s;
      (*b)(2 * leg + 1) = q(kFootZ + leg) - q(kBodyZ) - offset * s + p.leg_length * c;
    }
  }

  /// Dropped upright, feet 0.5 m above ground.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(14);
    run.u = Vector::Zero(0);
    run.x(kBodyZ) = 0.5 + p.leg_length;
    for (int leg = 0; leg < 2; ++leg) {
      run.x(kFootX + leg) = leg == 0 ? -p.hip_offset : p.hip_offset;
      run.x(kFootZ + leg) = 0.5;
    }
    run.duration = 1.4;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
