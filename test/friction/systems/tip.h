// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// last is the height.
template <int D>
struct Tip {
  static constexpr const char* kName = "tip";
  static constexpr const char* kSummary = "tip with coupled inertia";
  static constexpr int kDof = D, kConstraints = 1, kInputs = 0, kSlipDimension = D - 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, D> Names() {
    if constexpr (D == 2) {
      return {"x", "z"};
    } else {
      return {"x", "y", "z"};
    }
  }
  static constexpr std::array<const char*, D> Units() {
    if constexpr (D == 2) {
      return {"m", "m"};
    } else {
      return {"m", "m", "m"};
    }
  }
  static constexpr std::array<const char*, D> kCoordinates = Names(), kUnits = Units();
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    std::array<P, D * D> mass;
    std::array<P, D> force, stiffness;
    Parameters() {
      for (int i = 0; i < D * D; ++i) mass[i] = i % (D + 1) == 0 ? 1.0 : 0.0;
      force.fill(P(0.0));
      stiffness.fill(P(0.0));
    }
    template <class Visitor>
    void Visit(Visitor&& visit) {
      static const char* const kMass[] = {"m0", "m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8"};
      static const char* const kForce[] = {"f0", "f1", "f2"};
      static const char* const kStiffness[] = {"k0", "k1", "k2"};
      for (int i = 0; i < D * D; ++i) visit(mass[i], kMass[i], "kg", "", Range::kAny);
      for (int i = 0; i < D; ++i) visit(force[i], kForce[i], "N", "", Range::kAny);
      for (int i = 0; i < D; ++i) visit(stiffness[i], kStiffness[i], "N/m", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, D, 1>&,
                         Eigen::Matrix<S, D, D>* M) {
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) (*M)(i, j) = S(p.mass[i * D + j]);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, D, 1>& q,
                    const Eigen::Matrix<S, D, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, D, 1>* f) {
    for (int i = 0; i < D; ++i) (*f)(i) = S(p.force[i]) - p.stiffness[i] * q(i);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, D, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(D - 1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, D, 1>&,
                   const Eigen::Matrix<S, D, 1>& v, Eigen::Matrix<S, D - 1, 1>* s) {
    for (int i = 0; i < D - 1; ++i) (*s)(i) = v(i);
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
    run.x = Vector::Zero(2 * D);
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
