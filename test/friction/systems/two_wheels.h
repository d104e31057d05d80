// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/model_system.h"
#include "test/shorthands.h"
#include "test/test_models.h"

namespace contact_flow {
namespace test {

/// Two wheels of 1 kg on a floor, each pushed at its centre.
struct TwoWheels : UnitMasses<6, 2> {
  static constexpr double kMu = 0.5, kRadius = 0.1, kInertia = 0.004;
  static constexpr const char* kName = "two_wheels";
  static constexpr std::array<const char*, 6> kCoordinates = {"x1", "z1", "angle1",
                                                              "x2", "z2", "angle2"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "rad", "m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor 1", "floor 2"};
  static constexpr int kSlipDimension = 1;
  template <class P>
  struct Parameters {
    P push = 0, restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(push, "push", "N", "on each wheel", Range::kAny);
      visit(restitution, "restitution", "", "of the floor", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const P&, const Eigen::Matrix<S, 6, 1>&, Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(i != j ? 0.0 : i % 3 == 2 ? kInertia : 1.0);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                    const Eigen::Matrix<S, 6, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 0; i < 6; i += 3) {
      (*f)(i) = S(p.push);
      (*f)(i + 1) = S(-kGravity);
      (*f)(i + 2) = S(0.0);
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = q(4);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0) - kRadius * v(2);
    (*s)(1) = v(3) - kRadius * v(5);
  }
  template <class P>
  static P Friction(const Parameters<P>&, int) {
    return P(kMu);
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
};

}  // namespace test
}  // namespace contact_flow
