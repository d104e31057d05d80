// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// Two tips coupled by a constant mass matrix, a spring and a damper between x1 and x2.
struct Pair {
  static constexpr const char* kName = "pair";
  static constexpr const char* kSummary = "two coupled tips";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 4> kCoordinates = {"x1", "z1", "x2", "z2"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    std::array<P, 16> mass;
    std::array<P, 4> force;
    P stiffness = 0, damping = 0;
    Parameters() {
      for (int i = 0; i < 16; ++i) mass[i] = i % 5 == 0 ? 1.0 : 0.0;
      force.fill(P(0.0));
    }
    template <class Visitor>
    void Visit(Visitor&& visit) {
      static const char* const kMass[] = {"m0", "m1", "m2",  "m3",  "m4",  "m5",  "m6",  "m7",
                                          "m8", "m9", "m10", "m11", "m12", "m13", "m14", "m15"};
      static const char* const kForce[] = {"f0", "f1", "f2", "f3"};
      for (int i = 0; i < 16; ++i) visit(mass[i], kMass[i], "kg", "", Range::kAny);
      for (int i = 0; i < 4; ++i) visit(force[i], kForce[i], "N", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(damping, "damping", "N s/m", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                         Eigen::Matrix<S, 4, 4>* M) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(p.mass[i * 4 + j]);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    for (int i = 0; i < 4; ++i) (*f)(i) = S(p.force[i]);
    const S pull = p.stiffness * (q(2) - q(0)) + p.damping * (v(2) - v(0));
    (*f)(0) += pull;
    (*f)(2) -= pull;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = q(3);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>&,
                   const Eigen::Matrix<S, 4, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(2);
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
    run.x = Vector::Zero(8);
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
