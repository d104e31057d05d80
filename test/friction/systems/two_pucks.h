// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// Two point masses on a floor in space, joined by a spring and a damper, and driven apart.
struct TwoPucks {
  static constexpr const char* kName = "two_pucks";
  static constexpr const char* kSummary = "two joined pucks";
  static constexpr int kDof = 6, kConstraints = 2, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {"x1", "y1", "z1", "x2", "y2", "z2"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass_1 = 1, mass_2 = 1.5, gravity = 9.81, stiffness = 15, damping = 0.8, gap = 0.5,
      quadratic = 2;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass_1, "mass_1", "kg", "", Range::kPositive);
      visit(mass_2, "mass_2", "kg", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(damping, "damping", "N s/m", "", Range::kAny);
      visit(gap, "gap", "m", "", Range::kAny);
      visit(quadratic, "quadratic", "N s^2/m^2", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 3 ? S(p.mass_1) : S(p.mass_2);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>& q,
                    const Eigen::Matrix<S, 6, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 0; i < 3; ++i) {
      S pull = p.stiffness * (q(3 + i) - q(i)) + p.damping * (v(3 + i) - v(i));
      if (i == 0) pull -= S(p.stiffness * p.gap);
      (*f)(i) = pull;
      (*f)(3 + i) = -pull;
    }
    const S drive = p.quadratic * (v(2) - v(5)) * (v(2) - v(5));
    (*f)(0) -= drive;
    (*f)(3) += drive;
    (*f)(2) -= S(p.mass_1 * p.gravity);
    (*f)(5) -= S(p.mass_2 * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(2);
    (*a)(1) = q(5);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 4, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
    (*s)(2) = v(3);
    (*s)(3) = v(4);
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
