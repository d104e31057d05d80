// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A ball thrown up under a ceiling z ≤ height: the grazing example of the paper's Sec. 6.1. Thrown
/// from z = 0 with ż = √(2·gravity·height) it just reaches the ceiling, and the outcome has no
/// derivative; thrown faster it meets it at the speed s = √(ż² − 2·gravity·height), and the
/// derivative grows like 1/s.
struct Ceiling {
  static constexpr const char* kName = "ceiling";
  static constexpr const char* kSummary =
      "a ball thrown up under a ceiling; grazes it at one speed (Sec. 6.1)";
  static constexpr int kDof = 1, kConstraints = 1, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 1> kCoordinates = {"z"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"ceiling"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    P mass = 1, gravity = 9.81, height = 1, restitution = 0.5;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "mass of the ball", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "downward acceleration", Range::kAny);
      visit(height, "height", "m", "height of the ceiling", Range::kPositive);
      visit(restitution, "restitution", "", "restitution of the ceiling", Range::kUnitInterval);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                         Eigen::Matrix<S, 1, 1>* M) {
    (*M)(0, 0) = S(p.mass);
  }

  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>&,
                    const Eigen::Matrix<S, 1, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = S(-p.mass * p.gravity);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>& q,
                   Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = p.height - q(0);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }

  /// Thrown from z = 0, so fast that it hits the ceiling at 2 m/s (at any gravity that
  /// is not negative).
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    using std::sqrt;
    NominalRun run;
    run.x.resize(2);
    run.x << 0, (p.gravity > 0 ? sqrt(2 * p.gravity * p.height + 4) : 2.0);
    run.u = Vector::Zero(0);
    run.duration = 0.6;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
