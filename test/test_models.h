// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>

#include "contact_flow/model/model_system.h"

/// Small systems with known motions, for tests only.
namespace contact_flow {
namespace test {

/// What all of them share: no inputs, unit masses.
template <int D, int N>
struct UnitMasses {
  static constexpr int kDof = D, kConstraints = N, kInputs = 0;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr const char* kSummary = "a test system";
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters {
    template <class V>
    void Visit(V&&) {}
  };
  template <class P, class S>
  static void MassMatrix(const P&, const Eigen::Matrix<S, D, 1>&, Eigen::Matrix<S, D, D>* M) {
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) (*M)(i, j) = S(i == j ? 1.0 : 0.0);
    }
  }
  template <class P>
  static auto Restitution(const P&, int) {
    return 0;
  }
  template <class P>
  static NominalRun Nominal(const P&) {
    NominalRun run;
    run.x = Vector::Zero(2 * D);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// y = centre + amplitude·cos(t + phase) above a floor: ÿ = −(y − centre).
struct Oscillator : UnitMasses<1, 1> {
  static constexpr const char* kName = "oscillator";
  static constexpr std::array<const char*, 1> kCoordinates = {"y"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P centre = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(centre, "centre", "m", "middle of the motion", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 1, 1>& q,
                    const Eigen::Matrix<S, 1, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = p.centre - q(0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 1, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

/// A block on a floor pressed by the force load + cos(w), with w a clock: λ = load + cos w.
struct PressedBlock : UnitMasses<2, 1> {
  static constexpr const char* kName = "pressed_block";
  static constexpr std::array<const char*, 2> kCoordinates = {"y", "clock"};
  static constexpr std::array<const char*, 2> kUnits = {"m", "s"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  template <class P>
  struct Parameters {
    P load = 1;
    template <class V>
    void Visit(V&& visit) {
      visit(load, "load", "N", "mean load", Range::kAny);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 2, 1>& q,
                    const Eigen::Matrix<S, 2, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 2, 1>* f) {
    using std::cos;
    (*f)(0) = -(cos(q(1)) + p.load);
    (*f)(1) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 2, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0);
  }
};

/// ẍ = ẋ², which escapes to infinity at t = 1/ẋ(0); the constraint is far away.
struct Escape : UnitMasses<1, 1> {
  static constexpr const char* kName = "escape";
  static constexpr std::array<const char*, 1> kCoordinates = {"x"};
  static constexpr std::array<const char*, 1> kUnits = {"m"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"wall"};
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, 1, 1>&,
                    const Eigen::Matrix<S, 1, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 1, 1>* f) {
    (*f)(0) = v(0) * v(0);
  }
  template <class P, class S>
  static void Gaps(const P&, const Eigen::Matrix<S, 1, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(0) + 10.0;
  }
};

/// A body on m soft legs in a row: body height, a spin, and m foot heights; every foot is a mass of
/// its own on a spring, so that any touchdowns are orthogonal, and the spin is driven by squared
/// differences of the foot rates, so that every order of touchdowns has a derivative of its own.
template <int Legs>
struct LegRow : UnitMasses<Legs + 2, Legs> {
  using Config = std::array<const char*, Legs + 2>;
  static constexpr const char* kName = "leg_row";
  static constexpr Config Fill(const char* text) {
    Config names{};
    for (int i = 0; i < Legs + 2; ++i) names[i] = text;
    return names;
  }
  static constexpr Config kCoordinates = Fill("coordinate");
  static constexpr Config kUnits = Fill("m");
  static constexpr std::array<const char*, 12> kFeet = {"foot_0", "foot_1", "foot_2",  "foot_3",
                                                        "foot_4", "foot_5", "foot_6",  "foot_7",
                                                        "foot_8", "foot_9", "foot_10", "foot_11"};
  static constexpr std::array<const char*, Legs> FirstFeet() {
    std::array<const char*, Legs> names{};
    for (int i = 0; i < Legs; ++i) names[i] = kFeet[i];
    return names;
  }
  static constexpr std::array<const char*, Legs> kConstraintNames = FirstFeet();
  template <class P>
  struct Parameters {
    P restitution = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(restitution, "restitution", "", "of every foot", Range::kUnitInterval);
    }
  };
  template <class P, class S>
  static void Force(const Parameters<P>&, const Eigen::Matrix<S, Legs + 2, 1>& q,
                    const Eigen::Matrix<S, Legs + 2, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, Legs + 2, 1>* f) {
    S body = S(-1.0), spin = -1.0 * q(1);
    for (int i = 0; i < Legs; ++i) {
      const S spring = 5.0 * (q(0) - q(2 + i) - 1.0);
      body -= spring;
      (*f)(2 + i) = spring - 1.0;
      for (int j = 0; j < i; ++j) {
        const S difference = v(2 + i) - v(2 + j);
        spin += (0.1 * (i + 1)) * (difference * difference);
      }
    }
    (*f)(0) = body;
    (*f)(1) = spin;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, Legs + 2, 1>& q,
                   Eigen::Matrix<S, Legs, 1>* a) {
    for (int i = 0; i < Legs; ++i) (*a)(i) = q(2 + i);
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int) {
    return p.restitution;
  }
  /// All feet 0.5 m above ground, springs at rest: they land together at t = 1 s.
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(2 * (Legs + 2));
    run.u = Vector::Zero(0);
    run.x(0) = 1.5;
    run.x.segment(2, Legs).setConstant(0.5);
    run.duration = 1.2;
    return run;
  }
};

template <class Model>
ModelSystem<Model> Make(const ParameterValues& parameters = {}) {
  return ModelSystem<Model>(parameters);
}

}  // namespace test
}  // namespace contact_flow
