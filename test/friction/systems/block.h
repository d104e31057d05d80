// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/model_system.h"
#include "test/friction/systems/contact_parameters.h"

namespace contact_flow {
namespace test {

/// A block on a plane tilted by `incline`, downhill is +x; q = (x, z, clock).
struct Block {
  static constexpr const char* kName = "block";
  static constexpr const char* kSummary = "block on an incline, driven";
  static constexpr int kDof = 3, kConstraints = 1, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass = 1, gravity = 9.81, incline = 0, stiffness = 0, amplitude = 0, frequency = 1, phase = 0,
      normal_amplitude = 0, normal_frequency = 1;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(incline, "incline", "rad", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(amplitude, "amplitude", "N", "", Range::kAny);
      visit(frequency, "frequency", "rad/s", "", Range::kAny);
      visit(phase, "phase", "rad", "", Range::kAny);
      visit(normal_amplitude, "normal_amplitude", "N", "", Range::kAny);
      visit(normal_frequency, "normal_frequency", "rad/s", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
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
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    using std::cos;
    using std::sin;
    (*f)(0) = S(p.mass * p.gravity * sin(p.incline)) +
              p.amplitude * sin(p.frequency * q(2) + p.phase) - p.stiffness * q(0);
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
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    return run;
  }
};


}  // namespace test
}  // namespace contact_flow
