// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A rimless wheel: a hub on eight spokes that rolls down a slope on their ends, which never slip;
/// each impact is plastic and lets the spoke behind go. In the frame of the slope, x downhill and z
/// away from it, spoke k is at the angle φ_k = k π/4 − angle from −z:
///   foot = hub + l (sin φ_k, −cos φ_k),   M = diag(m, m, I).
/// From impact to impact ω² gains 4 (g/l) sin(π/8) sin(slope) / (1 + ρ), ρ = I/(m l²), and an
/// impact multiplies ω by η = (cos(π/4) + ρ) / (1 + ρ): the step's eigenvalue is η², ½ where I → 0.
struct RimlessWheel {
  static constexpr const char* kName = "rimless_wheel";
  static constexpr const char* kSummary =
      "rimless wheel of eight spokes that do not slip, rolling down a slope from spoke to spoke";
  static constexpr int kDof = 3, kConstraints = 8, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 3> kCoordinates = {"hub_x", "hub_z", "angle"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 8> kConstraintNames = {
      "spoke_1", "spoke_2", "spoke_3", "spoke_4", "spoke_5", "spoke_6", "spoke_7", "spoke_8"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  static constexpr double kBetween = M_PI / 4;  ///< angle between spokes

  template <class P>
  struct Parameters {
    P mass = 1, inertia = 1e-3, length = 1, gravity = 9.81, slope = 0.08;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the wheel", Range::kPositive);
      visit(inertia, "inertia", "kg m^2", "inertia of the wheel about its hub", Range::kPositive);
      visit(length, "length", "m", "length of a spoke", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(slope, "slope", "rad", "angle of the ground", Range::kAny);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 2 ? S(p.mass) : S(p.inertia);
    }
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    using std::cos;
    using std::sin;
    (*f)(0) = S(p.mass * p.gravity * sin(p.slope));
    (*f)(1) = S(-p.mass * p.gravity * cos(p.slope));
    (*f)(2) = S(0.0);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 8, 1>* a) {
    using std::cos;
    for (int k = 0; k < 8; ++k) (*a)(k) = q(1) - p.length * cos(k * kBetween - q(2));
  }

  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 8, 1>* s) {
    using std::cos;
    for (int k = 0; k < 8; ++k) (*s)(k) = v(0) - p.length * cos(k * kBetween - q(2)) * v(2);
  }

  template <class P>
  static P Friction(const Parameters<P>&, int) {
    return P(contact_flow::Friction::kNoSlip);
  }
  template <class P>
  static P Restitution(const Parameters<P>&, int) {
    return P(0.0);
  }

  /// The rolling motion from behind an impact of the first spoke, through the next one.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    const double half = kBetween / 2, rho = p.inertia / (p.mass * p.length * p.length);
    const double eta = (std::cos(kBetween) + rho) / (1 + rho);
    const double gain = 4 * (p.gravity / p.length) * std::sin(half) * std::sin(p.slope) / (1 + rho);
    const double omega = eta * std::sqrt(std::max(0.0, gain) / (1 - eta * eta));
    NominalRun run;
    run.x.resize(6);
    run.x << -p.length * std::sin(half), p.length * std::cos(half), -half,
        p.length * std::cos(half) * omega, p.length * std::sin(half) * omega, omega;
    run.u = Vector::Zero(0);
    run.duration = 1.5;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
