// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Eigenvalues>
#include <cmath>
#include <utility>

#include "test/adversary/recipes.h"

namespace contact_flow {
namespace adversary {

Matrix DrawCoupling(Coupling kind, int k, Draw* draw) {
  for (int attempt = 0; attempt < 200; ++attempt) {
    Matrix G = Matrix::Identity(k, k);
    for (int i = 0; i < k; ++i) {
      for (int j = 0; j < i; ++j) {
        double g = 0;
        switch (kind) {
          case Coupling::kBlocks:
          case Coupling::kOrthogonal:
            break;
          case Coupling::kAttracting:
            g = draw->Chance(0.3) ? 0 : -draw->Uniform(0, 0.7);
            break;
          case Coupling::kAny:
            g = draw->Chance(0.2) ? 0 : draw->Uniform(-0.9, 0.9);
            break;
          case Coupling::kDegenerate:
            g = draw->Uniform(-0.8, 0.8);
            break;
          case Coupling::kWeak:
            g = draw->Log(1e-9, 1e-3) * draw->Sign();
            break;
          case Coupling::kParallel:
            g = i == 1 ? draw->Sign() * (1 - draw->Log(1e-6, 1e-2)) : draw->Uniform(-0.1, 0.1);
        }
        G(i, j) = G(j, i) = g;
      }
    }
    if (kind == Coupling::kDegenerate && k >= 3) {
      G(1, 0) = G(0, 1) = G(2, 0) * G(2, 1);
      if (draw->Chance(0.3) && k >= 4) G(3, 0) = G(0, 3) = G(3, 1) * G(1, 0);
    }
    const double smallest = kind == Coupling::kParallel ? 1e-7 : 0.05;
    if (Eigen::SelfAdjointEigenSolver<Matrix>(G).eigenvalues()(0) > smallest) return G;
  }
  return Matrix::Identity(k, k);
}

double DrawRestitution(bool plastic, Draw* draw) {
  const int kind = draw->Below(6);
  const double gamma = kind == 0 ? 0 : kind == 1 ? 1e-6 : kind == 2 ? 1 : draw->Uniform(0.1, 1);
  return plastic ? 0 : gamma;
}

Units DrawUnits(int d, int n, Draw* draw) {
  Units units = Units::Same(d, n);
  if (draw->Chance(0.5)) return units;
  // Powers of two: what is built to cancel still does.
  const auto power = [&](double low, double high) {
    return std::exp2(std::round(std::log2(draw->Log(low, high))));
  };
  const int kind = draw->Below(3);
  double length = 1;
  if (kind == 0) {
    length = power(1e-8, 1e8);
    units.mass = power(1e-8, 1e8);
    units.time = power(1e-8, 1e8);
  }
  units.length *= length;
  units.gap *= length;
  if (kind == 1) {  // masses of very different size
    for (int i = 0; i < d; ++i) units.length(i) *= power(1e-4, 1);
  }
  for (int i = d - 1; i > 0; --i) {
    std::swap(units.coordinate[i], units.coordinate[draw->Below(i + 1)]);
  }
  for (int i = n - 1; i > 0; --i) {
    std::swap(units.constraint[i], units.constraint[draw->Below(i + 1)]);
  }
  return units;
}

}  // namespace adversary
}  // namespace contact_flow
