// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string>

#include "contact_flow/model/model_system.h"

namespace contact_flow {
namespace test {

template <int N>
struct TipNames;
template <>
struct TipNames<2> {
  static constexpr std::array<const char*, 4> kCoordinates = {"x1", "z1", "x2", "z2"};
  static constexpr std::array<const char*, 4> kUnits = {"m", "m", "m", "m"};
  static constexpr std::array<const char*, 2> kConstraints = {"first", "second"};
};
template <>
struct TipNames<3> {
  static constexpr std::array<const char*, 6> kCoordinates = {"x1", "z1", "x2", "z2", "x3", "z3"};
  static constexpr std::array<const char*, 6> kUnits = {"m", "m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 3> kConstraints = {"first", "second", "third"};
};

/// N = 2 or 3 tips over a floor in the plane, coupled by a constant mass matrix, and neighbours by
/// a spring and a damper between their x.
template <int N>
struct Tips {
  static constexpr const char* kName = N == 2 ? "pair" : "tips";
  static constexpr const char* kSummary = "coupled tips";
  static constexpr int kDof = 2 * N, kConstraints = N, kInputs = 0, kSlipDimension = 1;
  static constexpr bool kConstantMass = true, kAffineConstraints = true;
  static constexpr auto kCoordinates = TipNames<N>::kCoordinates;
  static constexpr auto kUnits = TipNames<N>::kUnits;
  static constexpr auto kConstraintNames = TipNames<N>::kConstraints;
  static constexpr std::array<const char*, 0> kInputNames = {};

  template <class P>
  struct Parameters {
    std::array<P, 4 * N * N> mass;
    std::array<P, 2 * N> force;
    std::array<P, N> mu, gamma;  // μ_i < 0 stands for no slip
    P stiffness = 0, damping = 0;
    Parameters() {
      for (int i = 0; i < 4 * N * N; ++i) mass[i] = P(i % (2 * N + 1) == 0 ? 1.0 : 0.0);
      force.fill(P(0.0));
      mu.fill(P(1.0));
      gamma.fill(P(0.0));
    }
    template <class Visitor>
    void Visit(Visitor&& visit) {
      static const auto kMass = Numbered<4 * N * N>("m");
      static const auto kForce = Numbered<2 * N>("f");
      static const auto kMu = Numbered<N>("mu"), kGamma = Numbered<N>("gamma");
      for (int i = 0; i < 4 * N * N; ++i) visit(mass[i], kMass[i].c_str(), "kg", "", Range::kAny);
      for (int i = 0; i < 2 * N; ++i) visit(force[i], kForce[i].c_str(), "N", "", Range::kAny);
      visit(stiffness, "stiffness", "N/m", "", Range::kAny);
      visit(damping, "damping", "N s/m", "", Range::kAny);
      for (int i = 0; i < N; ++i) visit(mu[i], kMu[i].c_str(), "", "", Range::kAny);
      for (int i = 0; i < N; ++i) visit(gamma[i], kGamma[i].c_str(), "", "", Range::kUnitInterval);
    }

   private:
    template <std::size_t K>
    static std::array<std::string, K> Numbered(const std::string& letter) {
      std::array<std::string, K> names;
      for (std::size_t i = 0; i < K; ++i) names[i] = letter + std::to_string(i);
      return names;
    }
  };
  template <class S>
  using Positions = Eigen::Matrix<S, 2 * N, 1>;

  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Positions<S>&,
                         Eigen::Matrix<S, 2 * N, 2 * N>* M) {
    for (int i = 0; i < 2 * N; ++i) {
      for (int j = 0; j < 2 * N; ++j) (*M)(i, j) = S(p.mass[i * 2 * N + j]);
    }
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Positions<S>& q, const Positions<S>& v,
                    const Eigen::Matrix<S, 0, 1>&, Positions<S>* f) {
    for (int i = 0; i < 2 * N; ++i) (*f)(i) = S(p.force[i]);
    for (int i = 0; i + 2 < 2 * N; i += 2) {
      const S pull = p.stiffness * (q(i + 2) - q(i)) + p.damping * (v(i + 2) - v(i));
      (*f)(i) += pull;
      (*f)(i + 2) -= pull;
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>&, const Positions<S>& q, Eigen::Matrix<S, N, 1>* a) {
    for (int i = 0; i < N; ++i) (*a)(i) = q(2 * i + 1);
  }
  template <class P, class S>
  static void Slip(const Parameters<P>&, const Positions<S>&, const Positions<S>& v,
                   Eigen::Matrix<S, N, 1>* s) {
    for (int i = 0; i < N; ++i) (*s)(i) = v(2 * i);
  }
  template <class P>
  static P Friction(const Parameters<P>& p, int i) {
    return p.mu[i] < P(0.0) ? P(contact_flow::Friction::kNoSlip) : p.mu[i];
  }
  template <class P>
  static P Restitution(const Parameters<P>& p, int i) {
    return p.gamma[i];
  }
  template <class P>
  static NominalRun Nominal(const Parameters<P>&) {
    NominalRun run;
    run.x = Vector::Zero(4 * N);
    run.u = Vector::Zero(0);
    return run;
  }
};

using Pair = Tips<2>;

}  // namespace test
}  // namespace contact_flow
