// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"
#include "point_foot_biped.h"

namespace contact_flow {
namespace example {

/// The periodic hopping trot of the paper's Fig. 3: as soft_biped, with legs that push. In the body
/// frame a foot is at (lateral + hip offset, −ℓ); the axial force is
///   −k (ℓ−ℓ₀) − c ℓ̇ + push · tanh(ℓ̇/push_rate) · e²/(e² + push_strain²),   e = (ℓ−ℓ₀)/ℓ₀,
/// and a lateral spring and damper hold lateral = 0. The paper gives no parameters; the defaults
/// give apex height 0.8 m, period 0.8 s, simultaneous touchdown at 0.1 s and lift-off at 0.7 s.
struct HoppingTrot : PointFootBiped {
  static constexpr const char* kName = "hopping_trot";
  static constexpr const char* kSummary =
      "body on two pushing legs with point feet; periodic trot of Fig. 3";

  template <class P>
  struct Parameters {
    P body_mass = 1, foot_mass = 0.1, body_inertia = 0.05, gravity = 9.81, hip_offset = 0.5;
    P leg_length = 0.75442713321021629, axial_stiffness = 32.488288908534154;
    P axial_damping = 1.2834934738545232, push = 2.5496355456825017;
    P push_rate = 0.3, push_strain = 0.1, lateral_stiffness = 20, lateral_damping = 1;
    P flywheel = 0.05;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(body_mass, "body_mass", "kg", "mass of the body", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each foot", Range::kPositive);
      visit(body_inertia, "body_inertia", "kg m^2", "inertia of the body about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(hip_offset, "hip_offset", "m", "distance from body centre to hip", Range::kNonNegative);
      visit(leg_length, "leg_length", "m", "rest length of a leg", Range::kPositive);
      visit(axial_stiffness, "axial_stiffness", "N/m", "stiffness along a leg",
            Range::kNonNegative);
      visit(axial_damping, "axial_damping", "N s/m", "damping along a leg", Range::kNonNegative);
      visit(push, "push", "N", "largest force that feeds energy into a moving leg", Range::kAny);
      visit(push_rate, "push_rate", "m/s", "leg rate at which the push saturates",
            Range::kPositive);
      visit(push_strain, "push_strain", "", "leg strain at which the push is half on",
            Range::kPositive);
      visit(lateral_stiffness, "lateral_stiffness", "N/m", "stiffness across a leg",
            Range::kNonNegative);
      visit(lateral_damping, "lateral_damping", "N s/m", "damping across a leg",
            Range::kNonNegative);
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
    using std::tanh;
    const S c = cos(q(kPitch)), s = sin(q(kPitch));
    S body_x = S(0.0), body_z = S(-p.body_mass * p.gravity);
    const S rate_difference = v(kFootZ) - v(kFootZ + 1);
    S torque = p.flywheel * (rate_difference * rate_difference);
    for (int leg = 0; leg < 2; ++leg) {
      const P offset = leg == 0 ? P(-p.hip_offset) : p.hip_offset;
      const S dx = q(kFootX + leg) - q(kBodyX), dz = q(kFootZ + leg) - q(kBodyZ);
      const S along = c * dx + s * dz, up = c * dz - s * dx;  // foot in the body frame
      const S ux = v(kFootX + leg) - v(kBodyX), uz = v(kFootZ + leg) - v(kBodyZ);
      const S lateral_rate = c * ux + s * uz + v(kPitch) * up;
      const S length_rate = s * ux - c * uz + v(kPitch) * along;
      const S stretch = -up - p.leg_length;
      const S strain = stretch / p.leg_length;
      const S strain2 = strain * strain;
      const S rate = length_rate / p.push_rate;
      const S engaged = strain2 / (strain2 + p.push_strain * p.push_strain);
      const S axial = p.push * (tanh(rate) * engaged) - p.axial_stiffness * stretch -
                      p.axial_damping * length_rate;
      const S lateral = -p.lateral_stiffness * (along - offset) - p.lateral_damping * lateral_rate;
      const S fx = axial * s + lateral * c, fz = lateral * s - axial * c;  // on the foot
      (*f)(kFootX + leg) = fx;
      (*f)(kFootZ + leg) = fz - p.foot_mass * p.gravity;
      body_x -= fx;
      body_z -= fz;
      torque += axial * along + lateral * up;
    }
    (*f)(kBodyX) = body_x;
    (*f)(kBodyZ) = body_z;
    (*f)(kPitch) = torque;
  }

  /// One period from the apex of the periodic orbit (exact for the default parameters).
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(14);
    run.u = Vector::Zero(0);
    run.x(kBodyZ) = 0.8;
    for (int leg = 0; leg < 2; ++leg) {
      run.x(kFootX + leg) = leg == 0 ? -p.hip_offset : p.hip_offset;
      run.x(kFootZ + leg) = 0.01293536463167720;
      run.x(7 + kFootZ + leg) = 0.2163857230862298;
    }
    run.duration = 0.8;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
