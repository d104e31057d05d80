// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// A unit point mass (x, y) and a clock w in the force field
///   (−1 + 0.7 y + 0.3 ẏ − 0.2 ẇ w,  w − 0.5 x (1 + ẋ²) + 0.4 x w,  0):
/// sliding on the floor y ≥ 0 it is lifted off at the very instant at which it meets the wall x ≥ 0
/// (simultaneous activation and release, the paper's Fig. 2).
struct WallAndFloor {
  static constexpr const char* kName = "wall_and_floor";
  static constexpr const char* kSummary =
      "a sliding point leaves the floor at the instant it hits a wall; activation and release of "
      "Fig. 2";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "y", "clock"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "s"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"floor", "wall"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    template <class Visitor>
    void Visit(Visitor&&) {}
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = S(i == j ? 1.0 : 0.0);
    }
  }

  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    const S x = q(0), y = q(1), w = q(2);
    const S lift = 0.4 * (x * w) - 0.5 * (x * (v(0) * v(0)));
    (*f)(0) = 0.7 * y + 0.3 * v(1) - 0.2 * (v(2) * w) - 1.0;
    (*f)(1) = w - 0.5 * x + lift;
    (*f)(2) = S(0.0);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q,
                   Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = q(0);
  }

  template <class P>
  static auto Restitution(const Parameters<P>&, int) {
    return 0;
  }

  /// Sliding towards the wall; both events fall on t = 1 s, where the clock passes zero.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(6);
    run.x << 1.5333333333333334, 0, -1, -1.1, 0, 1;
    run.u = Vector::Zero(0);
    run.duration = 2;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
