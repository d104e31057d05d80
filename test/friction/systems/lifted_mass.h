// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

/// A point of mass 1 over a floor in the plane, and a clock w. It is pushed along the floor by the
/// input f, and lifted by rate w + g.
struct LiftedMass {
  static constexpr const char* kName = "lifted_mass";
  static constexpr const char* kSummary = "a point that a growing force lifts";
  static constexpr int kDof = 3, kConstraints = 1, kInputs = 2, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 2> kInputNames = {"f", "g"};

  template <class P>
  struct Parameters {
    P rate = 20, friction = 0.5, gravity = 9.81;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(rate, "rate", "N/s", "", Range::kAny);
      visit(friction, "friction", "", "", Range::kAny);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(i == j ? 1.0 : 0.0);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 2, 1>& u,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = u(0);
    (*f)(1) = p.rate * q(2) + u(1) - p.gravity;
    (*f)(2) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 1, 1>* s) {
    (*s)(0) = v(0);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>&, int) {
    return P(0.0);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(5) = 1;
    run.u = Vector::Zero(2);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
