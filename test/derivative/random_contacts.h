// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "test/test_models.h"

namespace contact_flow {
namespace test {

/// Four contacts on five coordinates, a_i = n_i·q, of which `kinds` says what the normals are; M is
/// diagonal, the last of its entries `mass`, the force constant. All coefficients from `seed`.
///   0  a plank on two supports (height, tilt, width 1), two balls above it, and a rod
///   1  random unit normals
///   2  contacts 1 and 2 are coupled with 0 only: G_12 = G_01 G_02 / G_00, so that they are
///      orthogonal as long as 0 holds
///   3  random, all G_ij ≤ 0
struct Contacts : UnitMasses<5, 4> {
  static constexpr const char* kName = "contacts";
  static constexpr std::array<const char*, 5> kCoordinates = {"q0", "q1", "q2", "q3", "q4"};
  static constexpr std::array<const char*, 5> kUnits = {"m", "m", "m", "m", "m"};
  static constexpr std::array<const char*, 4> kConstraintNames = {"c0", "c1", "c2", "c3"};
  template <class P>
  struct Parameters {
    P seed = 1, kind = 0, mass = 1, first = 0, second = 0, third = 0, fourth = 0;
    template <class V>
    void Visit(V&& visit) {
      visit(seed, "seed", "", "of all coefficients", Range::kAny);
      visit(kind, "kind", "", "of the normals", Range::kAny);
      visit(mass, "mass", "kg", "of q4", Range::kAny);
      visit(first, "first", "", "restitution", Range::kUnitInterval);
      visit(second, "second", "", "restitution", Range::kUnitInterval);
      visit(third, "third", "", "restitution", Range::kUnitInterval);
      visit(fourth, "fourth", "", "restitution", Range::kUnitInterval);
    }
  };
  static double Number(double value) { return value; }
  template <class S, int N>
  static double Number(const Dual<S, N>& x) {
    return Number(x.value);
  }
  static Eigen::Matrix<double, 4, 5> Normals(double seed, int kind) {
    std::mt19937 generator(static_cast<unsigned>(seed));
    const auto uniform = [&](double low, double high) {
      return low + (high - low) * (generator() / 4294967296.0);
    };
    Eigen::Matrix<double, 4, 5> n;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 5; ++j) n(i, j) = uniform(-1, 1);
      n.row(i).normalize();
    }
    if (kind == 0) {
      // q = (height, tilt / √12, ball, ball, rod) of a plank of unit mass.
      const double s = std::sqrt(12.0);
      const double left = uniform(-0.5, 0), right = uniform(0.05, 0.5);
      n << 1, -s * left, 0, 0, 0, 1, -s * right, 0, 0, 0,  //
          -1, s * uniform(-0.5, 0.5), 1, 0, 0, -1, s * uniform(-0.5, 0.5), 0, 1, 0;
    } else if (kind == 2) {
      n.setZero();
      n(0, 0) = 1;
      for (int i : {1, 2}) {
        const double angle = uniform(1.7, 2.6);
        n(i, 0) = std::cos(angle);
        n(i, i) = std::sin(angle);
      }
      n(3, 3) = 1;
    } else if (kind == 3) {
      // Cholesky factor of an M-matrix with unit diagonal.
      Eigen::Matrix4d G = Eigen::Matrix4d::Identity();
      for (int i = 0; i < 4; ++i) {
        for (int j = 0; j < i; ++j) G(i, j) = G(j, i) = -uniform(0, 0.3);
      }
      n.setZero();
      n.leftCols<4>() = Eigen::Matrix4d(G.llt().matrixL());
    }
    return n;
  }
  template <class P, class S>
  static void MassMatrix(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                         Eigen::Matrix<S, 5, 5>* M) {
    UnitMasses::MassMatrix(p, q, M);
    (*M)(4, 4) = S(p.mass);
  }
  template <class P, class S>
  static void Force(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>&,
                    const Eigen::Matrix<S, 5, 1>& v, const Eigen::Matrix<S, 0, 1>&,
                    Eigen::Matrix<S, 5, 1>* f) {
    // Presses onto all, ä_i = −2 where M = 1.
    const Eigen::Matrix<double, 4, 5> n = Normals(Number(p.seed), static_cast<int>(Number(p.kind)));
    const Eigen::Matrix<double, 5, 1> press =
        -2 * n.transpose() * (n * n.transpose()).ldlt().solve(Eigen::Vector4d::Ones());
    std::mt19937 generator(static_cast<unsigned>(Number(p.seed)) + 77);
    for (int i = 0; i < 5; ++i) {
      (*f)(i) = S(press(i));
      for (int j = 0; j < 5; ++j) {
        const double c = 0.6 * (generator() / 4294967296.0 - 0.5);
        (*f)(i) += c * v(j);
      }
    }
  }
  template <class P, class S>
  static void Gaps(const Parameters<P>& p, const Eigen::Matrix<S, 5, 1>& q,
                   Eigen::Matrix<S, 4, 1>* a) {
    const Eigen::Matrix<double, 4, 5> n = Normals(Number(p.seed), static_cast<int>(Number(p.kind)));
    for (int i = 0; i < 4; ++i) {
      (*a)(i) = S(0.0);
      for (int j = 0; j < 5; ++j) (*a)(i) += n(i, j) * q(j);
    }
  }
  template <class P>
  static auto Restitution(const Parameters<P>& p, int i) {
    return i == 0 ? p.first : i == 1 ? p.second : i == 2 ? p.third : p.fourth;
  }
};

}  // namespace test
}  // namespace contact_flow
