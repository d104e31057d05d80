// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/model/parameter_values.h"

namespace contact_flow {
namespace example {

/// Two discs on a table without friction: the first is driven, and pushes the second, which may
/// bounce off a wall, y₂ + r₂ ≤ wall. The problems of single and multiple collisions of Hu, Long,
/// Zang, E and Han (arXiv 2205.08622) and of Zhong, Han, Dey and Brikis (arXiv 2305.00092).
struct TwoDiscs {
  static constexpr const char* kName = "two_discs";
  static constexpr const char* kSummary =
      "two elastic discs on a table with a wall, the first of which is driven";
  static constexpr int kDof = 4, kConstraints = 3, kInputs = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"x1", "y1", "x2", "y2"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraintNames = {"discs", "first wall",
                                                                  "second wall"};
  static constexpr std::array<const char*, 2> kInputNames = {"force x", "force y"};

  template <class P>
  struct Parameters {
    P first_mass = 1, second_mass = 1, first_radius = 0.2, second_radius = 0.2;
    P restitution = 1, wall_restitution = 1, wall = 10;

    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(first_mass, "first_mass", "kg", "mass of the driven disc", Range::kPositive);
      visit(second_mass, "second_mass", "kg", "mass of the other one", Range::kPositive);
      visit(first_radius, "first_radius", "m", "radius of the driven disc", Range::kPositive);
      visit(second_radius, "second_radius", "m", "radius of the other one", Range::kPositive);
      visit(restitution, "restitution", "", "between the discs", Range::kUnitInterval);
      visit(wall_restitution, "wall_restitution", "", "of the wall", Range::kUnitInterval);
      visit(wall, "wall", "m", "y of the wall", Range::kAny);
    }
  };

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                         Eigen::Matrix<S, 4, 4>* M) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = S(i < 2 ? p.first_mass : p.second_mass);
    }
  }

  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>&,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 2, 1>& u,
                    Eigen::Matrix<S, 4, 1>* f) {
    (*f)(0) = u(0);
    (*f)(1) = u(1);
    (*f)(2) = (*f)(3) = S(0.0);
  }

  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   Eigen::Matrix<S, 3, 1>* a) {
    using std::sqrt;
    const S x = q(2) - q(0), y = q(3) - q(1);
    (*a)(0) = sqrt(x * x + y * y) - (p.first_radius + p.second_radius);
    (*a)(1) = p.wall - p.first_radius - q(1);
    (*a)(2) = p.wall - p.second_radius - q(3);
  }

  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.restitution : p.wall_restitution;
  }

  /// A push from below.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x.resize(8);
    run.x << -1, -2, -1, -1, 0, 0, 0, 0;
    run.u.resize(2);
    run.u << 0, 3;
    run.duration = 1;
    return run;
  }
};

}  // namespace example
}  // namespace contact_flow
