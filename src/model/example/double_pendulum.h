// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A double pendulum of two uniform rods with torques [N·m] at its joints, without gravity, with
/// elastic stops q₁ ≥ 0 on the shoulder and q₂ ≤ acos(−d/b) on the elbow, the angle at which the
/// two stops are orthogonal in the kinetic metric:
///   M = [[a + 2b cos q₂, d + b cos q₂], [d + b cos q₂, d]].
struct DoublePendulum {
  static constexpr const char* kName = "double_pendulum";
  static constexpr const char* kSummary =
      "two rods with elastic shoulder and elbow stops that are orthogonal where both are met";
  static constexpr int kDof = 2, kConstraints = 2, kInputs = 2;
  static constexpr bool kConstantMass = false, kAffineConstraints = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"shoulder", "elbow"};
  static constexpr std::array<const char*, 2> kUnits = {"rad", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"shoulder_stop", "elbow_stop"};
  static constexpr std::array<const char*, 2> kInputNames = {"shoulder_torque", "elbow_torque"};

  template <class P>
  struct Parameters {
    P m0 = 1, m1 = 1, l0 = 0.5, l1 = 2.0 / 7.0, restitution = 0.3;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(m0, "m0", "kg", "mass of the upper rod", Range::kPositive);
      visit(m1, "m1", "kg", "mass of the lower rod", Range::kPositive);
      visit(l0, "l0", "m", "length of the upper rod", Range::kPositive);
      visit(l1, "l1", "m", "length of the lower rod; at most 6/7 of l0", Range::kPositive);
      visit(restitution, "restitution", "", "restitution of both stops", Range::kUnitInterval);
    }
  };

  template <class P>
  struct Inertias {
    P a, b, d;
  };
  /// a, b, d [kg·m²] of the mass matrix.
  template <class P>
  static Inertias<P> InertiasOf(const Parameters<P>& p) {
    const P rod0 = p.m0 * p.l0 * p.l0, rod1 = p.m1 * p.l1 * p.l1;
    Inertias<P> inertia;
    inertia.d = rod1 / 3.0 + rod1 / 4.0;
    inertia.b = p.m1 * p.l0 * p.l1 / 2.0;
    inertia.a = rod0 / 3.0 + rod0 / 4.0 + p.m1 * p.l0 * p.l0 + inertia.d;
    return inertia;
  }

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                         Eigen::Matrix<S, 2, 2>* M) {
    using std::cos;
    const Inertias<P> inertia = InertiasOf(p);
    const S bc = inertia.b * cos(q(1));
    const S off = bc + inertia.d;
    (*M)(0, 0) = bc + bc + inertia.a;
    (*M)(0, 1) = (*M)(1, 0) = off;
    (*M)(1, 1) = S(inertia.d);
  }

  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 2, 1>& u,
                    Eigen::Matrix<S, 2, 1>* f) {
    *f = u;
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::acos;
    const Inertias<P> inertia = InertiasOf(p);
    const P ratio = -inertia.d / inertia.b;
    (*a)(0) = q(0);
    (*a)(1) = acos(ratio) - q(1);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Reaches both stops at once after 0.7 s (for the default parameters).
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(4);
    run.x << 0.6815425611627202, 1.294268962131482, -0.9920579097150921, 1.9429129037623927;
    run.u = Vector::Zero(2);
    run.duration = 1.4;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
