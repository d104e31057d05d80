// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/contact_mode.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A rigid chair in the plane that sinks with two feet into soft parabolic ground, y = −x² (after
/// Council, Revzen and Burden, arXiv 2102.10702): the effort depends on the contact mode
/// (Sec. 6.1).
///
/// A foot at (x, y) has the gap a = y + x²; while a < 0 the ground pushes it along ∇a with −k a − c
/// ȧ. The damper makes the field jump at touchdown and at lift-off, so that feet that land together
/// give an outcome that is only piecewise differentiable: event-selected, for ȧ is the
/// same on both sides.
struct Chair {
  static constexpr const char* kName = "chair";
  static constexpr const char* kSummary =
      "rigid chair whose two feet sink into soft parabolic ground; spring-damper contact forces";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = false, kContactEffort = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "pitch"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  static ConstraintSet Compliant() { return {0, 1}; }

  template <class P>
  struct Parameters {
    P mass = 1, inertia = 0.1, gravity = 1, leg_length = 0.5, foot_offset = 0.3, stiffness = 40,
      damping = 2;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the chair", Range::kPositive);
      visit(inertia, "inertia", "kg m^2", "inertia about its centre", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "height of the centre over the feet", Range::kPositive);
      visit(foot_offset, "foot_offset", "m", "half the distance of the feet", Range::kPositive);
      visit(stiffness, "stiffness", "N/m", "of the ground", Range::kNonNegative);
      visit(damping, "damping", "N s/m", "of the ground", Range::kNonNegative);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(2, 2) = S(p.inertia);
  }

  /// The foot relative to the centre.
  template <class P, class S>
  static void Arm(const Parameters<P>& p, const S& pitch, int foot, S* x, S* y) {
    using std::cos;
    using std::sin;
    const P offset = foot == 0 ? P(-p.foot_offset) : p.foot_offset;
    const S c = cos(pitch), s = sin(pitch);
    *x = offset * c + p.leg_length * s;
    *y = offset * s - p.leg_length * c;
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    const ContactMode& mode, Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(2) = S(0.0);
    (*f)(1) = S(-p.mass * p.gravity);
    for (int foot : mode) {
      S arm_x, arm_y;
      Arm(p, q(2), foot, &arm_x, &arm_y);
      const S slope = 2.0 * (q(0) + arm_x);  // ∇a = (slope, 1)
      const S gap = q(1) + arm_y + 0.25 * slope * slope;
      const S rate = slope * (v(0) - arm_y * v(2)) + v(1) + arm_x * v(2);
      const S push = -(p.stiffness * gap) - p.damping * rate;
      (*f)(0) += push * slope;
      (*f)(1) += push;
      (*f)(2) += push * (arm_x - arm_y * slope);
    }
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    for (int foot = 0; foot < 2; ++foot) {
      S arm_x, arm_y;
      Arm(p, q(2), foot, &arm_x, &arm_y);
      const S x = q(0) + arm_x;
      (*a)(foot) = q(1) + arm_y + x * x;
    }
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Dropped upright over the vertex: both feet land at once.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    run.x(1) = p.leg_length - p.foot_offset * p.foot_offset + 0.2;
    run.duration = 0.8;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
