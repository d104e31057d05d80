// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A quadruped in the vertical plane: a body (x, z, pitch) with a hind and a front pair of rigid
/// legs that swing on torsion springs at hips ahead of and behind the centre; the feet are point
/// masses, the ground is frictionless. A foot is at
///   (x, z) + R(pitch) (±offset, 0) + leg_length (sin ψ, −cos ψ),   ψ = pitch + leg angle.
/// Simultaneous, front-first and hind-first touchdown lead to three outcomes that stay apart
/// however small the difference in time (the phenomenon of Remy and Buffinton), unlike
/// rigid_biped's without its mirror symmetry and with legs that spin up at touchdown.
struct RigidQuadruped {
  static constexpr const char* kName = "rigid_quadruped";
  static constexpr const char* kSummary =
      "body on swinging rigid front and hind legs; three outcomes: front first, hind first, both "
      "at once";
  static constexpr int kDof = 5, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = false, kAffineConstraints = false;
  static constexpr std::array<const char*, 5> kCoordinates = {"body_x", "body_z", "body_pitch",
                                                              "hind_leg", "front_leg"};
  static constexpr std::array<const char*, 5> kUnits = {"m", "m", "rad", "rad", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"hind_foot", "front_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  /// Indices of the coordinates; leg 0 is hind, 1 is front.
  static constexpr int kBodyX = 0, kBodyZ = 1, kPitch = 2, kLeg = 3;

  template <class P>
  struct Parameters {
    P body_mass = 2, foot_mass = 0.2, body_inertia = 0.2, gravity = 9.81, leg_length = 0.4;
    P hind_offset = 0.25, front_offset = 0.2, stance = 0.2, hip_stiffness = 30;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(body_mass, "body_mass", "kg", "mass of the body", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each pair of feet", Range::kPositive);
      visit(body_inertia, "body_inertia", "kg m^2", "inertia of the body about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "length of a leg", Range::kPositive);
      visit(hind_offset, "hind_offset", "m", "distance from body centre back to the hind hip",
            Range::kNonNegative);
      visit(front_offset, "front_offset", "m", "distance from body centre on to the front hip",
            Range::kNonNegative);
      visit(stance, "stance", "rad", "angle by which the legs at rest are spread outwards",
            Range::kAny);
      visit(hip_stiffness, "hip_stiffness", "N m/rad", "torsional stiffness of a hip",
            Range::kNonNegative);
    }
  };

  /// From body centre to hip along the body, positive to the front.
  template <class P>
  static P HipOffset(const Parameters<P>& p, int leg) {
    return leg == 0 ? P(-p.hind_offset) : p.front_offset;
  }

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                         Eigen::Matrix<S, 5, 5>* M) {
    using std::cos;
    using std::sin;
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 5; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(kBodyX, kBodyX) = (*M)(kBodyZ, kBodyZ) = S(p.body_mass + 2.0 * p.foot_mass);
    const S c = cos(q(kPitch)), s = sin(q(kPitch));
    const P swing = p.foot_mass * p.leg_length;  // [kg·m]
    S mx = S(0.0), mz = S(0.0), inertia = S(p.body_inertia);
    for (int leg = 0; leg < 2; ++leg) {
      const P offset = HipOffset(p, leg);
      const S psi = q(kPitch) + q(kLeg + leg);
      const S across = (swing * offset) * sin(q(kLeg + leg));
      const S leg_x = swing * cos(psi), leg_z = swing * sin(psi);
      mx += leg_x - (p.foot_mass * offset) * s;
      mz += leg_z + (p.foot_mass * offset) * c;
      inertia += 2.0 * across + p.foot_mass * (offset * offset + p.leg_length * p.leg_length);
      (*M)(kBodyX, kLeg + leg) = (*M)(kLeg + leg, kBodyX) = leg_x;
      (*M)(kBodyZ, kLeg + leg) = (*M)(kLeg + leg, kBodyZ) = leg_z;
      (*M)(kPitch, kLeg + leg) = (*M)(kLeg + leg, kPitch) = across + swing * p.leg_length;
      (*M)(kLeg + leg, kLeg + leg) = S(swing * p.leg_length);
    }
    (*M)(kBodyX, kPitch) = (*M)(kPitch, kBodyX) = mx;
    (*M)(kBodyZ, kPitch) = (*M)(kPitch, kBodyZ) = mz;
    (*M)(kPitch, kPitch) = inertia;
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                    const Eigen::Matrix<S, 5, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 5, 1>* f) {
    using std::cos;
    using std::sin;
    const P weight = p.foot_mass * p.gravity;
    S torque = S(0.0);
    for (int leg = 0; leg < 2; ++leg) {
      const P rest = leg == 0 ? P(-p.stance) : p.stance;
      const S swing = (weight * p.leg_length) * sin(q(kPitch) + q(kLeg + leg));
      torque -= swing + (weight * HipOffset(p, leg)) * cos(q(kPitch));
      (*f)(kLeg + leg) = -swing - p.hip_stiffness * (q(kLeg + leg) - rest);
    }
    (*f)(kBodyX) = S(0.0);
    (*f)(kBodyZ) = S(-(p.body_mass + 2.0 * p.foot_mass) * p.gravity);
    (*f)(kPitch) = torque;
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    for (int leg = 0; leg < 2; ++leg) {
      (*a)(leg) = q(kBodyZ) + HipOffset(p, leg) * sin(q(kPitch)) -
                  p.leg_length * cos(q(kPitch) + q(kLeg + leg));
    }
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Dropped level from 0.1 m, moving forward, legs at rest: all feet land at once.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::cos;
    NominalRun run;
    run.x = Vector::Zero(10);
    run.u = Vector::Zero(0);
    run.x(kBodyZ) = 0.1 + p.leg_length * cos(p.stance);
    run.x(kLeg) = -p.stance;
    run.x(kLeg + 1) = p.stance;
    run.x(5 + kBodyX) = 1;
    run.duration = 0.18;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
