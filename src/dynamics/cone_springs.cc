// SPDX-License-Identifier: BSD-3-Clause
#include "cone_springs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

/// Newton's steps, the shortest part of one, and what the residual may keep, relative.
constexpr int kConeSteps = 60;
constexpr double kLeastConePart = 1e-4, kConeRounding = 1e-15, kConeSolved = 1e-11;
/// A spring carries this part of what leaves its cone, from all of it to nothing.
constexpr double kHardness[] = {1, 0.3, 0.1, 0.03, 0.01, 1e-3, 1e-4, 0};

/// Newton's method for w.
class ConeNewton {
 public:
  ConeNewton(const ConeSprings& springs, const Vector& right)
      : springs_(springs), load_(springs.rows * right), size_(load_.cwiseAbs().maxCoeff()) {}

  bool Solve(double hardness, Vector* w) {
    hardness_ = hardness;
    Vector residual = Residual(*w);
    for (int k = 0; k < kConeSteps; ++k) {
      if (residual.cwiseAbs().maxCoeff() <= kConeRounding * size_) return true;
      const Eigen::PartialPivLU<Matrix> factor(Change(*w));
      const Vector step = -factor.solve(residual);
      if (!step.allFinite()) return false;
      double part = 2;
      Vector moved, next;
      do {
        part *= 0.5;
        moved = *w + part * step;
        next = Residual(moved);
      } while (!(next.norm() < residual.norm()) && part > kLeastConePart);
      if (!(next.norm() < residual.norm())) break;
      *w = moved;
      residual = next;
    }
    return residual.cwiseAbs().maxCoeff() <= kConeSolved * size_;
  }

  /// λ by what the springs are stretched by, and its derivative by w.
  Matrix ForceChange(const Vector& w) const {
    const Vector stretch = springs_.range * w;
    Matrix change = springs_.range;
    for (const ForceCone& cone : springs_.cones) {
      const int n = cone.normal, t = cone.tangential, count = cone.dimension;
      if (!(stretch(n) > 0)) {
        change.row(n) *= hardness_;
        change.middleRows(t, count) *= hardness_;
        continue;
      }
      const double radius = cone.coefficient * stretch(n);
      const Vector pull = stretch.segment(t, count);
      if (count == 0 || !(pull.norm() > radius)) continue;
      const Vector along = pull.normalized();
      const Matrix turned =
          radius / pull.norm() *
          (change.middleRows(t, count) - along * (along.transpose() * change.middleRows(t, count)));
      change.middleRows(t, count) =
          hardness_ * change.middleRows(t, count) +
          (1 - hardness_) * (cone.coefficient * along * springs_.range.row(n) + turned);
    }
    return change;
  }

  Matrix Change(const Vector& w) const { return springs_.H * ForceChange(w); }

 private:
  Vector Force(const Vector& w) const {
    const Vector stretch = springs_.range * w;
    Vector force = stretch;
    for (const ForceCone& cone : springs_.cones) {
      const int n = cone.normal, t = cone.tangential, count = cone.dimension;
      if (!(stretch(n) > 0)) {
        force(n) *= hardness_;
        force.segment(t, count) *= hardness_;
        continue;
      }
      const double radius = cone.coefficient * stretch(n),
                   length = stretch.segment(t, count).norm();
      if (count == 0 || !(length > radius)) continue;
      force.segment(t, count) *= hardness_ + (1 - hardness_) * radius / length;
    }
    return force;
  }

  Vector Residual(const Vector& w) const { return springs_.H * Force(w) - load_; }

  const ConeSprings& springs_;
  const Vector load_;
  const double size_;
  double hardness_ = 0;
};

}  // namespace

Matrix SolveConeSprings(const ConeSprings& springs, const Vector& right) {
  ConeNewton newton(springs, right);
  const Vector linear = (springs.H * springs.range).partialPivLu().solve(springs.rows * right);
  if (!linear.allFinite()) return {};
  Vector w = linear;
  bool solved = newton.Solve(0, &w);
  if (!solved) {
    w = linear;
    for (const double hardness : kHardness) {
      solved = newton.Solve(hardness, &w);
      if (!solved) return {};
    }
  }
  const Matrix change = newton.ForceChange(w);
  const Matrix inverse = change * (springs.H * change).partialPivLu().solve(springs.rows);
  if (!inverse.allFinite()) return {};
  return inverse;
}

}  // namespace contact_flow
