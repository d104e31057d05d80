// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// The rigid-leg trot of the paper's Fig. 1 (left): massless legs perpendicular to the body, point
/// feet at (∓hip_offset, −leg_length) in the body frame; minimal coordinates (x, z,
/// pitch) of the body.
struct RigidBiped {
  static constexpr const char* kName = "rigid_biped";
  static constexpr const char* kSummary =
      "body on two rigid legs; plastic touchdown; rigid-leg trot of Fig. 1, discontinuous outcome";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = false, kAffineConstraints = false;
  static constexpr std::array<const char*, 3> kCoordinates = {"body_x", "body_z", "body_pitch"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P body_mass = 1, foot_mass = 1, body_inertia = 1, gravity = 1, leg_length = 0.5,
      hip_offset = 0.25;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(body_mass, "body_mass", "kg", "mass of the body", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each foot", Range::kNonNegative);
      visit(body_inertia, "body_inertia", "kg m^2", "inertia of the body about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "length of a leg", Range::kNonNegative);
      visit(hip_offset, "hip_offset", "m", "distance from body centre to hip", Range::kNonNegative);
    }
  };

  /// The two feet together are a rigid pair: their centre lies leg_length below the body.
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                         Eigen::Matrix<S, 3, 3>* M) {
    using std::cos;
    using std::sin;
    const P feet = 2.0 * p.foot_mass;
    const S total = S(p.body_mass + feet);
    const S zero = S(0.0);
    const S mx = (feet * p.leg_length) * cos(q(2)), mz = (feet * p.leg_length) * sin(q(2));
    const S inertia =
        S(p.body_inertia + feet * (p.leg_length * p.leg_length + p.hip_offset * p.hip_offset));
    (*M)(0, 0) = (*M)(1, 1) = total;
    (*M)(0, 1) = (*M)(1, 0) = zero;
    (*M)(0, 2) = (*M)(2, 0) = mx;
    (*M)(1, 2) = (*M)(2, 1) = mz;
    (*M)(2, 2) = inertia;
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    using std::sin;
    const P feet = 2.0 * p.foot_mass;
    (*f)(0) = S(0.0);
    (*f)(1) = S(-(p.body_mass + feet) * p.gravity);
    (*f)(2) = (-(feet * p.leg_length) * p.gravity) * sin(q(2));
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    const S below = q(1) - p.leg_length * cos(q(2));
    const S lift = p.hip_offset * sin(q(2));
    (*a)(0) = below - lift;
    (*a)(1) = below + lift;
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Dropped upright from body height 1 m (feet 0.5 m above ground for the default leg).
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    run.x(1) = 0.5 + p.leg_length;
    run.duration = 1.4;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
