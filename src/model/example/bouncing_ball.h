// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A point mass (x, z) above a frictionless floor z ≥ 0. Bounces shrink by the restitution γ each:
/// from a fall that lasts t₁ they accumulate at t₁ (1 + γ)/(1 − γ), beyond which there is no
/// execution (Zeno).
struct BouncingBall {
  static constexpr const char* kName = "bouncing_ball";
  static constexpr const char* kSummary =
      "a ball bouncing on a floor; its bounces accumulate in finite time";
  static constexpr int kDof = 2, kConstraints = 1, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 2> kCoordinates = {"x", "z"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, restitution = 0.7;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the ball", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(restitution, "restitution", "", "restitution of the floor", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                         Eigen::Matrix<S, 2, 2>* M) {
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(0, 1) = (*M)(1, 0) = S(0.0);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>&,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    (*f)(0) = S(0.0);
    (*f)(1) = S(-p.mass * p.gravity);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 2, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown forward from 1 m height; two bounces (for the default parameters).
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(4);
    run.x << 0, 1, 1, 0;
    run.u = Vector::Zero(0);
    run.duration = 1.2;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
