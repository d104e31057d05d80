// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A table (z, pitch) on four vertical spring legs in its plane, each with a point foot of its own
/// mass, so that any touchdowns are orthogonal. A flywheel applies the pitch torque
/// flywheel·Σ_{i<j} (ż_i − ż_j)²: when all feet land at once, each of the 24 orders has a
/// derivative of its own.
struct LeggedTable {
  static constexpr const char* kName = "legged_table";
  static constexpr const char* kSummary =
      "a table on four spring legs that land at once: 24 orders, 24 linear pieces";
  static constexpr int kLegs = 4;
  static constexpr int kDof = 6, kConstraints = kLegs, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {
      "table_z",           "table_pitch",        "outer_left_foot_z",
      "inner_left_foot_z", "inner_right_foot_z", "outer_right_foot_z"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "rad", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 4> kConstraintNames = {
      "outer_left_foot", "inner_left_foot", "inner_right_foot", "outer_right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  /// Indices of the coordinates; feet from left to right.
  static constexpr int kTableZ = 0, kPitch = 1, kFootZ = 2;

  template <class P>
  struct Parameters {
    P table_mass = 2, foot_mass = 0.5, table_inertia = 0.3, gravity = 9.81;
    P leg_length = 0.5, outer_offset = 0.6, inner_offset = 0.25, stiffness = 200, flywheel = 0.2;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(table_mass, "table_mass", "kg", "mass of the table without feet", Range::kPositive);
      visit(foot_mass, "foot_mass", "kg", "mass of each foot", Range::kPositive);
      visit(table_inertia, "table_inertia", "kg m^2", "inertia of the table about its centre",
            Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(leg_length, "leg_length", "m", "rest length of a leg", Range::kPositive);
      visit(outer_offset, "outer_offset", "m", "distance from centre to the outer legs",
            Range::kNonNegative);
      visit(inner_offset, "inner_offset", "m", "distance from centre to the inner legs",
            Range::kNonNegative);
      visit(stiffness, "stiffness", "N/m", "stiffness of a leg", Range::kNonNegative);
      visit(flywheel, "flywheel", "N m s^2/m^2", "pitch torque per squared foot-rate difference",
            Range::kAny);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(kTableZ, kTableZ) = S(p.table_mass);
    (*M)(kPitch, kPitch) = S(p.table_inertia);
    for (int leg = 0; leg < kLegs; ++leg) (*M)(kFootZ + leg, kFootZ + leg) = S(p.foot_mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>& q,
                    const Eigen::Matrix<S, 6, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    using std::cos;
    using std::sin;
    const std::array<P, 4> offset = {P(-p.outer_offset), P(-p.inner_offset), p.inner_offset,
                                     p.outer_offset};
    const S c = cos(q(kPitch)), s = sin(q(kPitch));
    S lift = S(-p.table_mass * p.gravity), torque = S(0.0);
    for (int leg = 0; leg < kLegs; ++leg) {
      const S length = q(kTableZ) + offset[leg] * s - q(kFootZ + leg);
      const S push = p.stiffness * (p.leg_length - length);
      lift += push;
      torque += (offset[leg] * c) * push;
      (*f)(kFootZ + leg) = -push - p.foot_mass * p.gravity;
      for (int other = 0; other < leg; ++other) {
        const S difference = v(kFootZ + leg) - v(kFootZ + other);
        torque += p.flywheel * (difference * difference);
      }
    }
    (*f)(kTableZ) = lift;
    (*f)(kPitch) = torque;
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q,
                   Eigen::Matrix<S, 4, 1>* a) {
    for (int leg = 0; leg < kLegs; ++leg) (*a)(leg) = q(kFootZ + leg);
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Dropped level, with legs at rest, from 0.1 m: all four feet land at once.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    constexpr double kHeight = 0.1;
    NominalRun run;
    run.x = Vector::Zero(12);
    run.u = Vector::Zero(0);
    run.x(kTableZ) = kHeight + p.leg_length;
    run.x.segment(kFootZ, kLegs).setConstant(kHeight);
    run.duration = 0.2;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
