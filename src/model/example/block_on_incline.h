// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A block on a plane tilted by `incline`, in the plane's frame: x downhill, z away from it, and a
/// clock w. Gravity, a spring to the origin, a push u and two forces that swing with the clock act
/// on it:
///   m ẍ = m g sin φ − k x + A sin(ω w + ϕ) + u + λ_t,
///   m z̈ = −m g cos φ + B sin(ν w) + λ_n,   ẇ = 1.
struct BlockOnIncline {
  static constexpr const char* kName = "block_on_incline";
  static constexpr const char* kSummary =
      "block on an incline with friction: slides, stops and sticks; pushed and shaken if asked";
  static constexpr int kDof = 3, kConstraints = 1, kInputs = 1, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 1> kInputNames = {"push"};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, incline = 0.3, stiffness = 0, amplitude = 0, frequency = 1;
    P phase = 0, normal_amplitude = 0, normal_frequency = 1, friction = 0.5, restitution = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the block", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(incline, "incline", "rad", "angle of the plane", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "of a spring along the plane", Range::kAny);
      visit(amplitude, "amplitude", "N", "of the force along the plane", Range::kAny);
      visit(frequency, "frequency", "rad/s", "of the force along the plane", Range::kAny);
      visit(phase, "phase", "rad", "of the force along the plane", Range::kAny);
      visit(normal_amplitude, "normal_amplitude", "N", "of the force away from the plane",
            Range::kAny);
      visit(normal_frequency, "normal_frequency", "rad/s", "of the force away from the plane",
            Range::kAny);
      visit(friction, "friction", "", "coefficient of friction", Range::kNonNegative);
      visit(restitution, "restitution", "", "restitution of the contact", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(2, 2) = S(1.0);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 1, 1>& u,
                    Eigen::Matrix<S, 3, 1>* f) {
    using std::cos;
    using std::sin;
    (*f)(0) = S(p.mass * p.gravity * sin(p.incline)) +
              p.amplitude * sin(p.frequency * q(2) + p.phase) - p.stiffness * q(0) + u(0);
    (*f)(1) = S(-p.mass * p.gravity * cos(p.incline)) +
              p.normal_amplitude * sin(p.normal_frequency * q(2));
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
  static P Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown downhill at 1 m/s; it stops and stays.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(3) = run.x(5) = 1;
    run.u = Vector::Zero(1);
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
