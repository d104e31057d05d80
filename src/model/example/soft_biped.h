// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"
#include "point_foot_biped.h"

namespace contact_flow {
namespace example {

/// The soft-leg trot of the paper's Fig. 1 (right): each foot hangs from its hip on a spring, and a
/// flywheel applies the pitch torque flywheel·(ż_left − ż_right)².
struct SoftBiped : PointFootBiped {
  static constexpr const char* kName = "soft_biped";
  static constexpr const char* kSummary =
      "body on two point feet with spring legs; plastic touchdown; soft-leg trot of Fig. 1";

  template <class P>
  struct Parameters {
    P body_mass = 1, foot_mass = 1, body_inertia = 1, gravity = 1;
    P leg_length = 0.5, hip_offset = 0.25, stiffness = 27, flywheel = 1.5;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(body_mass, "body_mass", "kg", "mass of the body", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each foot", Range::kPositive);
      visit(body_inertia, "body_inertia", "kg m^2", "inertia of the body about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "rest length of a leg", Range::kPositive);
      visit(hip_offset, "hip_offset", "m", "distance from body centre to hip", Range::kNonNegative);
      visit(stiffness, "stiffness", "N/m", "axial stiffness of a leg", Range::kNonNegative);
      visit(flywheel, "flywheel", "N m s^2/m^2", "pitch torque per squared foot-rate difference",
            Range::kAny);
    }
  };

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 7, 1>& q,
                    const Eigen::Matrix<S, 7, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 7, 1>* f) {
    using std::cos;
    using std::sin;
    using std::sqrt;
    const S c = cos(q(kPitch)), s = sin(q(kPitch));
    S body_x = S(0.0), body_z = S(-p.body_mass * p.gravity);
    const S rate_difference = v(kFootZ) - v(kFootZ + 1);
    S torque = p.flywheel * (rate_difference * rate_difference);
    for (int leg = 0; leg < 2; ++leg) {
      const P offset = leg == 0 ? P(-p.hip_offset) : p.hip_offset;
      const S arm_x = offset * c, arm_z = offset * s;
      const S dx = q(kBodyX) + arm_x - q(kFootX + leg);
      const S dz = q(kBodyZ) + arm_z - q(kFootZ + leg);
      const S length = sqrt(dx * dx + dz * dz);
      const S tension =
          p.stiffness * (p.leg_length / length - 1.0);  // force on the hip, per length
      const S fx = tension * dx, fz = tension * dz;
      body_x += fx;
      body_z += fz;
      torque += arm_x * fz - arm_z * fx;
      (*f)(kFootX + leg) = -fx;
      (*f)(kFootZ + leg) = -fz - p.foot_mass * p.gravity;
    }
    (*f)(kBodyX) = body_x;
    (*f)(kBodyZ) = body_z;
    (*f)(kPitch) = torque;
  }

  /// Dropped from body height 1 m with legs at rest and no pitch.
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
