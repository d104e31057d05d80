// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A ball over a floor z ≥ 0 with a vertical force as input, m z̈ = u − m g: the first problem of
/// trajectories through contact (Kong, Payne, Council and Johnson, arXiv 2103.14584).
struct DrivenBall {
  static constexpr const char* kName = "driven_ball";
  static constexpr const char* kSummary = "a ball over a floor, with a vertical force as input";
  static constexpr int kDof = 1, kConstraints = 1, kInputs = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 1> kCoordinates = {"z"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 1> kInputNames = {"force"};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.8, restitution = 0.7;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the ball", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(restitution, "restitution", "", "restitution of the floor", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                         Eigen::Matrix<S, 1, 1>* M) {
    (*M)(0, 0) = S(p.mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                    const Eigen::Matrix<S, 1, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = u(0) - p.mass * p.gravity;
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 1, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    *a = q;
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Falls from 4 m, and has bounced once.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(2);
    run.x << 4, 0;
    run.u = Vector::Zero(1);
    run.duration = 1.004;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
