// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// A homogeneous ball in space; r, the integrated angular velocity.
struct Ball {
  static constexpr const char* kName = "ball";
  static constexpr const char* kSummary = "spinning ball";
  static constexpr int kDof = 6, kConstraints = 1, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {"x", "y", "z", "rx", "ry", "rz"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "rad", "rad", "rad"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass = 1, radius = 0.1, gravity = 9.81, force_x = 0, force_y = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(radius, "radius", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(force_x, "force_x", "N", "", Range::kAny);
      visit(force_y, "force_y", "N", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 3 ? S(p.mass) : S(0.4 * p.mass * p.radius * p.radius);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                    const Eigen::Matrix<S, 6, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 3; i < 6; ++i) (*f)(i) = S(0.0);
    (*f)(0) = S(p.force_x);
    (*f)(1) = S(p.force_y);
    (*f)(2) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0) - p.radius * v(4);
    (*s)(1) = v(1) + p.radius * v(3);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.Mu(i);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.Gamma(i);
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(12);
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
