// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace my_models {

/// A ball above a floor: M = m, f = −m g, a = z.
struct DroppedBall {
  static constexpr const char* kName = "dropped_ball";
  static constexpr const char* kSummary = "a ball on a floor";
  static constexpr int kDof = 1, kConstraints = 1, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;  // M, Da: constant
  static constexpr std::array<const char*, 1> kCoordinates = {"z"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, restitution = 0.5;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the ball", contact_flow::Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", contact_flow::Range::kAny);
      visit(restitution, "restitution", "", "restitution of the floor",
            contact_flow::Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                         Eigen::Matrix<S, 1, 1>* M) {
    (*M)(0, 0) = S(p.mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>& /*q*/,
                    const Eigen::Matrix<S, 1, 1>& /*v*/, const Eigen::Matrix<S, 0, 1>& /*u*/,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = S(-p.mass * p.gravity);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 1, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Dropped from 1 m.
  template <class P>
  static contact_flow::NominalRun Nominal(const Parameters<P>&) {
    contact_flow::NominalRun run;
    run.x.resize(2);
    run.x << 1, 0;
    run.u = contact_flow::Vector::Zero(0);
    run.duration = 1;
    return run;
  }
};

}  // namespace my_models
