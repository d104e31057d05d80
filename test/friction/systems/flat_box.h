// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

/// A uniform box in the plane with two corners over a floor: x, z and pitch of its centre, and a
/// clock w. It is pushed by u + rate w to the right, at the height `arm` above the floor where it
/// stands; pitch is counterclockwise, so that a push turns it over its right corner.
struct FlatBox {
  static constexpr const char* kName = "flat_box";
  static constexpr const char* kSummary = "a box on two corners, with friction";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 1, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"x", "z", "pitch", "clock"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "rad", "s"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left", "right"};
  static constexpr std::array<const char*, 1> kInputNames = {"push"};

  template <class P>
  struct Parameters {
    P mass = 2, width = 0.4, height = 1, gravity = 9.81, arm = 0.8, rate = 0;
    P friction = 0.8, restitution = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(width, "width", "m", "", Range::kPositive);
      visit(height, "height", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(arm, "arm", "m", "", Range::kAny);
      visit(rate, "rate", "N/s", "", Range::kAny);
      visit(friction, "friction", "", "negative: no slip", Range::kAny);
      visit(restitution, "restitution", "", "", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                         Eigen::Matrix<S, 4, 4>* M) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(2, 2) = S(p.mass * (p.width * p.width + p.height * p.height) / 12.0);
    (*M)(3, 3) = S(p.mass);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 4, 1>* f) {
    const S push = p.rate * q(3) + u(0);
    (*f)(0) = push;
    (*f)(1) = S(-p.mass * p.gravity);
    (*f)(2) = (0.5 * p.height - p.arm) * push;
    (*f)(3) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    const S base = q(1) - (0.5 * p.height) * cos(q(2));
    const S lift = (0.5 * p.width) * sin(q(2));
    (*a)(0) = base - lift;
    (*a)(1) = base + lift;
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   const Eigen::Matrix<S, 4, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    using std::cos;
    using std::sin;
    const S base = v(0) + (0.5 * p.height) * cos(q(2)) * v(2);
    const S turn = (0.5 * p.width) * sin(q(2)) * v(2);
    (*s)(0) = base + turn;
    (*s)(1) = base - turn;
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int) {
    return p.friction < P(0.0) ? P(contact_flow::Friction::kNoSlip) : p.friction;
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(8);
    run.x(1) = 0.5 * p.height;
    run.x(7) = 1;
    run.u = Vector::Zero(1);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
