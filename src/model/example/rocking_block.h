// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A uniform rectangular block (x, z, pitch of its centre) that rocks on the two corners of its
/// base, on a frictionless floor, with plastic impacts. When one corner lands while the other
/// leads, the pitch rate falls by (1 − k)/(1 + k), k = 3 width²/(width² + height²); the leading
/// corner lets go if k < 1 (a block higher than √2 times its width), else the block comes to rest.
struct RockingBlock {
  static constexpr const char* kName = "rocking_block";
  static constexpr const char* kSummary =
      "a block rocking on its two lower corners; the leading corner lets go when the other lands";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 3> kCoordinates = {"block_x", "block_z", "block_pitch"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_corner", "right_corner"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, width = 0.2, height = 1;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the block", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(width, "width", "m", "length of the base", Range::kPositive);
      visit(height, "height", "m", "height of the block", Range::kPositive);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.mass);
    (*M)(2, 2) = S(p.mass * (p.width * p.width + p.height * p.height) / 12.0);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(2) = S(0.0);
    (*f)(1) = S(-p.mass * p.gravity);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    const S base = q(1) - (0.5 * p.height) * cos(q(2));
    const S lift = (0.5 * p.width) * sin(q(2));
    (*a)(0) = base - lift;
    (*a)(1) = base + lift;
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Released at rest on its left corner, tilted by half the angle at which it would fall over.
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::atan2;
    using std::cos;
    using std::sin;
    const double tilt = 0.5 * atan2(p.width, p.height);
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    run.x(1) = 0.5 * (p.width * sin(tilt) + p.height * cos(tilt));
    run.x(2) = tilt;
    run.duration = 0.6;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
