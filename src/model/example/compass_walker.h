// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A passive walker of two rigid legs on a slope: a mass at the hip, one in each leg, point feet
/// that never slip, plastic heel strikes, at which the other foot lets go. In the frame of the
/// slope, x downhill and z away from it, with the angles of the legs from z:
///   foot = hip + l (sin θ, −cos θ).
/// Legs of equal length scuff where they pass each other. Each foot has a row of stones of its own,
/// at `stone` + 2 k `pitch`, as a walker with feet side by side has on two rails; between them the
/// ground of that foot is deeper:
///   a = z_foot + depth (y − ¼)⁴ for y > ¼,   y = sin²(π (x_foot − stone) / (2 pitch)),
/// so that within a third of `pitch` from a stone it is the plane.
struct CompassWalker {
  static constexpr const char* kName = "compass_walker";
  static constexpr const char* kSummary =
      "passive compass walker on a slope with feet that do not slip; two legs with masses";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = false, kAffineConstraints = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"hip_x", "hip_z", "left_leg",
                                                              "right_leg"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "rad", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters {
    P hip_mass = 10, leg_mass = 5, leg_inertia = 0, leg_length = 1, leg_centre = 0.5;
    P gravity = 9.81, slope = 0.052359877559829887, stone_left = 0, stone_right = 0.535446;
    P pitch = 0.535446, depth = 1;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(hip_mass, "hip_mass", "kg", "mass at the hip", Range::kPositive);
      visit(leg_mass, "leg_mass", "kg", "mass of each leg", Range::kPositive);
      visit(leg_inertia, "leg_inertia", "kg m^2", "inertia of a leg about its centre",
            Range::kNonNegative);
      visit(leg_length, "leg_length", "m", "from hip to foot", Range::kPositive);
      visit(leg_centre, "leg_centre", "m", "from hip to the leg's centre of mass",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(slope, "slope", "rad", "angle of the ground", Range::kAny);
      visit(stone_left, "stone_left", "m", "a stone of the left foot", Range::kAny);
      visit(stone_right, "stone_right", "m", "a stone of the right foot", Range::kAny);
      visit(pitch, "pitch", "m", "half of the way from stone to stone of a foot", Range::kPositive);
      visit(depth, "depth", "m", "of the ground between the stones", Range::kNonNegative);
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
  static P Friction(const Parameters<P>&, int) {
    return P(contact_flow::Friction::kNoSlip);
  }
  template <class P>
  static P Restitution(const Parameters<P>&, int) {
    return P(0.0);
  }

  /// The gait from behind a heel strike of the left foot, through the next one after 0.734346391 s.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    return Step(p, kStance, kStanceRate, kSwingRate, 1);
  }

 protected:
  /// Both feet on the ground, the left one ahead and at rest.
  template <class P>
  static NominalRun Step(const Parameters<P>& p, double angle, double stance_rate,
                         double swing_rate, double duration) {
    NominalRun run;
    run.x.resize(8);
    const double l = p.leg_length, forward = l * std::sin(angle), up = l * std::cos(angle);
    run.x << p.stone_left - forward, up, angle, -angle, -up * stance_rate, -forward * stance_rate,
        stance_rate, swing_rate;
    run.u = Vector::Zero(0);
    run.duration = duration;
    return run;
  }

 private:
  /// The gait of the default parameters.
  static constexpr double kStance = 0.271028680499, kStanceRate = -1.092383589884;
  static constexpr double kSwingRate = -0.377373948907;
};

}  // namespace example
}  // namespace contact_flow
