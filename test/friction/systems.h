// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "contact_flow/model/example/soft_biped.h"
#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

/// Parameters that all systems here have: mu_i < 0 stands for no slip.
template <class P>
struct ContactParameters {
  P mu0 = 1, mu1 = 1, gamma0 = 0, gamma1 = 0;

  template <class Visitor>
  void Visit(Visitor&& visit) {
    visit(mu0, "mu0", "", "friction of the first contact", Range::kAny);
    visit(mu1, "mu1", "", "friction of the second contact", Range::kAny);
    visit(gamma0, "gamma0", "", "restitution of the first contact", Range::kUnitInterval);
    visit(gamma1, "gamma1", "", "restitution of the second contact", Range::kUnitInterval);
  }
  P Mu(int i) const {
    const P mu = i == 0 ? mu0 : mu1;
    return mu < P(0.0) ? P(contact_flow::Friction::kNoSlip) : mu;
  }
  P Gamma(int i) const { return i == 0 ? gamma0 : gamma1; }
};

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
    (*f)(0) = S(p.mass * p.gravity * sin(p.incline)) + p.amplitude * sin(p.frequency * q(2) + p.phase) -
              p.stiffness * q(0);
    (*f)(1) = S(-p.mass * p.gravity * cos(p.incline)) +
              p.normal_amplitude * sin(p.normal_frequency * q(2));
    (*f)(2) = S(0.0);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 3, 1>& v,
                   Eigen::Matrix<S, 1, 1>* s) {
    (*s)(0) = v(0);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// A tip with constant apparent inertia, constant force and springs over a floor; D coordinates, the
/// last is the height.
template <int D>
struct Tip {
  static constexpr const char* kName = "tip";
  static constexpr const char* kSummary = "tip with coupled inertia";
  static constexpr int kDof = D, kConstraints = 1, kInputs = 0, kSlipDimension = D - 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, D> Names() {
    if constexpr (D == 2) {
      return {"x", "z"};
    } else {
      return {"x", "y", "z"};
    }
  }
  static constexpr std::array<const char*, D> Units() {
    if constexpr (D == 2) {
      return {"m", "m"};
    } else {
      return {"m", "m", "m"};
    }
  }
  static constexpr std::array<const char*, D> kCoordinates = Names(), kUnits = Units();
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    std::array<P, D * D> mass;
    std::array<P, D> force, stiffness;
    Parameters() {
      for (int i = 0; i < D * D; ++i) mass[i] = i % (D + 1) == 0 ? 1.0 : 0.0;
      force.fill(P(0.0));
      stiffness.fill(P(0.0));
    }
    template <class Visitor>
    void Visit(Visitor&& visit) {
      static const char* const kMass[] = {"m0", "m1", "m2", "m3", "m4", "m5", "m6", "m7", "m8"};
      static const char* const kForce[] = {"f0", "f1", "f2"};
      static const char* const kStiffness[] = {"k0", "k1", "k2"};
      for (int i = 0; i < D * D; ++i) visit(mass[i], kMass[i], "kg", "", Range::kAny);
      for (int i = 0; i < D; ++i) visit(force[i], kForce[i], "N", "", Range::kAny);
      for (int i = 0; i < D; ++i) visit(stiffness[i], kStiffness[i], "N/m", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, D, 1>&,
                         Eigen::Matrix<S, D, D>* M) {
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) (*M)(i, j) = S(p.mass[i * D + j]);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, D, 1>& q,
                    const Eigen::Matrix<S, D, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, D, 1>* f) {
    for (int i = 0; i < D; ++i) (*f)(i) = S(p.force[i]) - p.stiffness[i] * q(i);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, D, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(D - 1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, D, 1>&, const Eigen::Matrix<S, D, 1>& v,
                   Eigen::Matrix<S, D - 1, 1>* s) {
    for (int i = 0; i < D - 1; ++i) (*s)(i) = v(i);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(2 * D);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// Two tips coupled by a constant mass matrix, a spring and a damper between x1 and x2.
struct Pair {
  static constexpr const char* kName = "pair";
  static constexpr const char* kSummary = "two coupled tips";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 4> kCoordinates = {"x1", "z1", "x2", "z2"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    std::array<P, 16> mass;
    std::array<P, 4> force;
    P stiffness = 0, damping = 0;
    Parameters() {
      for (int i = 0; i < 16; ++i) mass[i] = i % 5 == 0 ? 1.0 : 0.0;
      force.fill(P(0.0));
    }
    template <class Visitor>
    void Visit(Visitor&& visit) {
      static const char* const kMass[] = {"m0", "m1", "m2",  "m3",  "m4",  "m5",  "m6",  "m7",
                                          "m8", "m9", "m10", "m11", "m12", "m13", "m14", "m15"};
      static const char* const kForce[] = {"f0", "f1", "f2", "f3"};
      for (int i = 0; i < 16; ++i) visit(mass[i], kMass[i], "kg", "", Range::kAny);
      for (int i = 0; i < 4; ++i) visit(force[i], kForce[i], "N", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(damping, "damping", "N s/m", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>&,
                         Eigen::Matrix<S, 4, 4>* M) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(p.mass[i * 4 + j]);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    for (int i = 0; i < 4; ++i) (*f)(i) = S(p.force[i]);
    const S pull = p.stiffness * (q(2) - q(0)) + p.damping * (v(2) - v(0));
    (*f)(0) += pull;
    (*f)(2) -= pull;
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(1);
    (*a)(1) = q(3);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 4, 1>& v,
                   Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(2);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(8);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// A uniform rod, theta from the vertical; foot and head may touch the floor.
struct Rod {
  static constexpr const char* kName = "rod";
  static constexpr const char* kSummary = "falling rod";
  static constexpr int kDof = 3, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = false;
  static constexpr std::array<const char*, 3> kCoordinates = {"x", "z", "theta"};
  static constexpr std::array<const char*, 3> kUnits = {"m", "m", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"foot", "head"};
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass = 1, half_length = 0.5, gravity = 9.81;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(half_length, "half_length", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
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
    (*M)(2, 2) = S(p.mass * p.half_length * p.half_length / 3.0);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = (*f)(2) = S(0.0);
    (*f)(1) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    (*a)(0) = q(1) - p.half_length * cos(q(2));
    (*a)(1) = q(1) + p.half_length * cos(q(2));
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>& q,
                   const Eigen::Matrix<S, 3, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    using std::cos;
    (*s)(0) = v(0) - p.half_length * cos(q(2)) * v(2);
    (*s)(1) = v(0) + p.half_length * cos(q(2)) * v(2);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.x(1) = p.half_length;
    run.u = Vector::Zero(0);
    return run;
  }
};

/// The soft-leg biped with friction at its feet.
struct SoftBipedWithFriction : example::SoftBiped {
  static constexpr int kSlipDimension = 1;
  template <class P>
  struct Parameters : example::SoftBiped::Parameters<P>, ContactParameters<P> {
    template <class Visitor>
    void Visit(Visitor&& visit) {
      example::SoftBiped::Parameters<P>::Visit(visit);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 7, 1>&, const Eigen::Matrix<S, 7, 1>& v,
                   Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(kFootX);
    (*s)(1) = v(kFootX + 1);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
};

/// A point mass on a floor in space, with a gyroscopic force and drag.
struct Puck : Tip<3> {
  static constexpr const char* kName = "puck";
  static constexpr const char* kSummary = "puck";
  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass = 1, gravity = 9.81, force_x = 0, force_y = 0, gyroscopic = 0, drag = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(force_x, "force_x", "N", "", Range::kAny);
      visit(force_y, "force_y", "N", "", Range::kAny);
      visit(gyroscopic, "gyroscopic", "N s/m", "", Range::kAny);
      visit(drag, "drag", "N s/m", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                         Eigen::Matrix<S, 3, 3>* M) {
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) (*M)(i, j) = i == j ? S(p.mass) : S(0.0);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 3, 1>&,
                    const Eigen::Matrix<S, 3, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 3, 1>* f) {
    (*f)(0) = S(p.force_x) - p.gyroscopic * v(1) - p.drag * v(0);
    (*f)(1) = S(p.force_y) + p.gyroscopic * v(0) - p.drag * v(1);
    (*f)(2) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 3, 1>&, const Eigen::Matrix<S, 3, 1>& v,
                   Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(6);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// A homogeneous ball in space; r, the integrated angular velocity.
struct Ball {
  static constexpr const char* kName = "ball";
  static constexpr const char* kSummary = "spinning ball";
  static constexpr int kDof = 6, kConstraints = 1, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {"x", "y", "z", "rx", "ry", "rz"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "rad", "rad", "rad"};
  static constexpr std::array<const char*, 1> kConstraintNames = {"floor"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass = 1, radius = 0.1, gravity = 9.81, force_x = 0, force_y = 0;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass, "mass", "kg", "", Range::kPositive);
      visit(radius, "radius", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(force_x, "force_x", "N", "", Range::kAny);
      visit(force_y, "force_y", "N", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 3 ? S(p.mass) : S(0.4 * p.mass * p.radius * p.radius);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                    const Eigen::Matrix<S, 6, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 3; i < 6; ++i) (*f)(i) = S(0.0);
    (*f)(0) = S(p.force_x);
    (*f)(1) = S(p.force_y);
    (*f)(2) = S(-p.mass * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q, Eigen::Matrix<S, 1, 1>* a) {
    (*a)(0) = q(2);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    (*s)(0) = v(0) - p.radius * v(4);
    (*s)(1) = v(1) + p.radius * v(3);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(12);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// Two point masses on a floor in space, joined by a spring and a damper, and driven apart.
struct TwoPucks {
  static constexpr const char* kName = "two_pucks";
  static constexpr const char* kSummary = "two joined pucks";
  static constexpr int kDof = 6, kConstraints = 2, kInputs = 0, kSlipDimension = 2;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr std::array<const char*, 6> kCoordinates = {"x1", "y1", "z1", "x2", "y2", "z2"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"first", "second"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P mass_1 = 1, mass_2 = 1.5, gravity = 9.81, stiffness = 15, damping = 0.8, gap = 0.5, quadratic = 2;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(mass_1, "mass_1", "kg", "", Range::kPositive);
      visit(mass_2, "mass_2", "kg", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(damping, "damping", "N s/m", "", Range::kAny);
      visit(gap, "gap", "m", "", Range::kAny);
      visit(quadratic, "quadratic", "N s^2/m^2", "", Range::kAny);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>&,
                         Eigen::Matrix<S, 6, 6>* M) {
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) (*M)(i, j) = S(0.0);
      (*M)(i, i) = i < 3 ? S(p.mass_1) : S(p.mass_2);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 6, 1>& q,
                    const Eigen::Matrix<S, 6, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 6, 1>* f) {
    for (int i = 0; i < 3; ++i) {
      S pull = p.stiffness * (q(3 + i) - q(i)) + p.damping * (v(3 + i) - v(i));
      if (i == 0) pull -= S(p.stiffness * p.gap);
      (*f)(i) = pull;
      (*f)(3 + i) = -pull;
    }
    const S drive = p.quadratic * (v(2) - v(5)) * (v(2) - v(5));
    (*f)(0) -= drive;
    (*f)(3) += drive;
    (*f)(2) -= S(p.mass_1 * p.gravity);
    (*f)(5) -= S(p.mass_2 * p.gravity);
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    (*a)(0) = q(2);
    (*a)(1) = q(5);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Eigen::Matrix<S, 6, 1>&,
                   const Eigen::Matrix<S, 6, 1>& v, Eigen::Matrix<S, 4, 1>* s) {
    (*s)(0) = v(0);
    (*s)(1) = v(1);
    (*s)(2) = v(3);
    (*s)(3) = v(4);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(12);
    run.u = Vector::Zero(0);
    return run;
  }
};

/// A compass walker, each foot with its own row of stepping stones; q = (hip_x, hip_z, left, right).
struct CompassWalker {
  static constexpr const char* kName = "compass_walker";
  static constexpr const char* kSummary = "compass walker on stones";
  static constexpr int kDof = 4, kConstraints = 2, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = false, kAffineConstraints = false;
  static constexpr std::array<const char*, 4> kCoordinates = {"hip_x", "hip_z", "left_leg", "right_leg"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "rad", "rad"};
  static constexpr std::array<const char*, 2> kConstraintNames = {"left_foot", "right_foot"};
  static constexpr std::array<const char*, 0> kInputNames = {};
  template <class P>
  struct Parameters : ContactParameters<P> {
    P hip_mass = 1000, leg_mass = 1, leg_inertia = 0, leg_length = 1, leg_centre = 1, gravity = 1,
      slope = 0.009, stone_left = 0, stone_right = 0, pitch = 0.4, depth = 1;
    template <class Visitor>
    void Visit(Visitor&& visit) {
      visit(hip_mass, "hip_mass", "kg", "", Range::kPositive);
      visit(leg_mass, "leg_mass", "kg", "", Range::kPositive);
      visit(leg_inertia, "leg_inertia", "kg m^2", "", Range::kNonNegative);
      visit(leg_length, "leg_length", "m", "", Range::kPositive);
      visit(leg_centre, "leg_centre", "m", "", Range::kPositive);
      visit(gravity, "gravity", "m/s^2", "", Range::kAny);
      visit(slope, "slope", "rad", "", Range::kAny);
      visit(stone_left, "stone_left", "m", "", Range::kAny);
      visit(stone_right, "stone_right", "m", "", Range::kAny);
      visit(pitch, "pitch", "m", "", Range::kPositive);
      visit(depth, "depth", "m", "", Range::kNonNegative);
      ContactParameters<P>::Visit(visit);
    }
  };
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                         Eigen::Matrix<S, 4, 4>* M) {
    using std::cos;
    using std::sin;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) (*M)(i, j) = S(0.0);
    }
    (*M)(0, 0) = (*M)(1, 1) = S(p.hip_mass + 2.0 * p.leg_mass);
    for (int i = 2; i < 4; ++i) {
      (*M)(i, i) = S(p.leg_mass * p.leg_centre * p.leg_centre + p.leg_inertia);
      (*M)(0, i) = (*M)(i, 0) = p.leg_mass * p.leg_centre * cos(q(i));
      (*M)(1, i) = (*M)(i, 1) = p.leg_mass * p.leg_centre * sin(q(i));
    }
  }
  /// Without Coriolis terms, which follow from M.
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                    const Eigen::Matrix<S, 4, 1>&, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 4, 1>* f) {
    using std::cos;
    using std::sin;
    const P gx = p.gravity * sin(p.slope), gz = -1.0 * p.gravity * cos(p.slope);
    const P mass = p.hip_mass + 2.0 * p.leg_mass;
    (*f)(0) = S(mass * gx);
    (*f)(1) = S(mass * gz);
    for (int i = 2; i < 4; ++i) {
      (*f)(i) = p.leg_mass * p.leg_centre * (gx * cos(q(i)) + gz * sin(q(i)));
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q, Eigen::Matrix<S, 2, 1>* a) {
    using std::cos;
    using std::sin;
    for (int i = 0; i < 2; ++i) {
      const S x = q(0) + p.leg_length * sin(q(2 + i));
      const P stone = i == 0 ? p.stone_left : p.stone_right;
      const S y = 0.5 * (1.0 - cos(M_PI * (x - stone) / p.pitch));
      S pit = S(0.0);
      if (y > S(0.25)) {
        const S deep = y - 0.25;
        pit = p.depth * deep * deep * deep * deep;
      }
      (*a)(i) = q(1) - p.leg_length * cos(q(2 + i)) + pit;
    }
  }
  template <class P, class S>
  static void Slip(const Parameters<P>& p, const Eigen::Matrix<S, 4, 1>& q,
                   const Eigen::Matrix<S, 4, 1>& v, Eigen::Matrix<S, 2, 1>* s) {
    using std::cos;
    for (int i = 0; i < 2; ++i) (*s)(i) = v(0) + p.leg_length * cos(q(2 + i)) * v(2 + i);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) { return p.Mu(i); }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) { return p.Gamma(i); }
  template <class P>
  static NominalRun Nominal(const Parameters<P>& p) {
    NominalRun run;
    run.x = Vector::Zero(8);
    run.x(1) = p.leg_length;
    run.u = Vector::Zero(0);
    return run;
  }
};

}  // namespace test
}  // namespace contact_flow
