// SPDX-License-Identifier: BSD-3-Clause
#include "slip_circle.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "slip_newton.h"

namespace contact_flow {
namespace {

/// Where F misses zero, or D is it, by this many times its rounding.
constexpr double kTouches = 16;
constexpr int kDegree = 4, kRootSteps = 200;

/// What the equations of the others leave of contact `one`: y_n, λ_n, λ_t and y_t, each affine in
/// three numbers z; the last column is what they are at z = 0.
using Affine = Eigen::Matrix<double, 7, 4>;
enum AffineRow { kNormalRate, kNormalForce, kForce1, kForce2, kSlip1, kSlip2, kOne };

bool Condense(const FrictionProblem& problem, const FrictionSolution& word, int one,
              Affine* affine) {
  const int n = problem.Row(static_cast<std::size_t>(one));
  HeldEquations others(problem, word, {one});
  const auto m = static_cast<Eigen::Index>(others.rows.size());
  affine->setZero();
  (*affine)(kOne, 3) = 1;
  if (m == 0) {
    affine->row(kNormalRate) << problem.G.block<1, 3>(n, n), problem.b(n);
    affine->block<3, 3>(kNormalForce, 0).setIdentity();
    affine->block<2, 3>(kSlip1, 0) = problem.G.block<2, 3>(n + 1, n);
    affine->block<2, 1>(kSlip1, 3) = problem.b.segment<2>(n + 1);
    return true;
  }
  // Forces of the others, and the three of this one: what keeps the others' equations.
  Matrix columns = Matrix::Zero(problem.b.size(), m + 3);
  columns.leftCols(m) = others.columns;
  columns.block<3, 3>(n, m).setIdentity();
  Vector unit(m + 3);
  for (Eigen::Index r = 0; r < m; ++r) {
    const int row = others.rows[static_cast<std::size_t>(r)];
    unit(r) = 1 / std::sqrt(problem.G(row, row));
  }
  for (int k = 0; k < 3; ++k) unit(m + k) = 1 / std::sqrt(problem.G(n + k, n + k));
  const Matrix push = problem.G * columns * unit.asDiagonal();
  Matrix held(m, m + 3);
  Vector target(m);
  for (Eigen::Index r = 0; r < m; ++r) {
    const int row = others.rows[static_cast<std::size_t>(r)];
    held.row(r) = unit(r) * push.row(row);
    target(r) = -unit(r) * problem.b(row);
  }
  if (!held.allFinite()) return false;
  const Eigen::FullPivLU<Matrix> factor(held);
  if (factor.rank() < m) return false;
  Matrix all(m + 3, 4);
  all << factor.kernel(), factor.solve(target);
  affine->block<3, 4>(kNormalForce, 0) = unit.tail<3>().asDiagonal() * all.bottomRows<3>();
  affine->row(kNormalRate) = push.row(n) * all;
  affine->block<2, 4>(kSlip1, 0) = push.middleRows<2>(n + 1) * all;
  (*affine)(kNormalRate, 3) += problem.b(n);
  affine->block<2, 1>(kSlip1, 3) += problem.b.segment<2>(n + 1);
  return affine->allFinite();
}

/// A determinant, and the sum of its terms' sizes.
struct Minor {
  double value = 0, size = 0;
};

Minor MinorOf(const Affine& affine, const std::array<int, 4>& rows) {
  constexpr int kPairs[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
  Minor minor;
  for (int k = 0; k < 6; ++k) {  // by pairs of columns
    const int a = kPairs[k][0], b = kPairs[k][1], c = kPairs[5 - k][0], d = kPairs[5 - k][1];
    const double sign = k == 1 || k == 4 ? -1 : 1;
    const double ab = affine(rows[0], a) * affine(rows[1], b);
    const double ba = affine(rows[0], b) * affine(rows[1], a);
    const double cd = affine(rows[2], c) * affine(rows[3], d);
    const double dc = affine(rows[2], d) * affine(rows[3], c);
    minor.value += sign * (ab - ba) * (cd - dc);
    minor.size += (std::abs(ab) + std::abs(ba)) * (std::abs(cd) + std::abs(dc));
  }
  return minor;
}

/// Real roots in [−1, 1] of Σ p_k xᵏ, one between each two values of different signs at its ends
/// and where its derivative vanishes.
class Quartic {
 public:
  std::array<double, kDegree + 1> p;
  double left, right;  // at −1 and 1: circles in two halves have each root once
  double rounding;

  std::vector<double> Roots() const {
    std::array<double, kDegree + 1> derived = p;
    std::vector<std::array<double, kDegree + 1>> of = {p};
    for (int degree = kDegree; degree > 1; --degree) {
      for (int k = 0; k < degree; ++k) {
        derived[static_cast<std::size_t>(k)] = (k + 1) * derived[static_cast<std::size_t>(k + 1)];
      }
      derived[static_cast<std::size_t>(degree)] = 0;
      of.push_back(derived);
    }
    std::vector<double> places;
    for (int degree = 1; degree <= kDegree; ++degree) {
      const auto& q = of[static_cast<std::size_t>(kDegree - degree)];
      places.insert(places.begin(), -1);
      places.push_back(1);
      std::vector<double> values;
      for (double x : places) values.push_back(At(q, x));
      if (degree == kDegree) {
        values.front() = left;
        values.back() = right;
      }
      std::vector<double> roots;
      for (std::size_t k = 1; k < places.size(); ++k) {
        if ((values[k - 1] < 0) != (values[k] < 0)) {
          roots.push_back(Between(q, places[k - 1], places[k], values[k - 1] < 0));
        } else if (degree == kDegree && k + 1 < places.size() &&
                   (values[k + 1] < 0) == (values[k] < 0) && std::abs(values[k]) <= rounding) {
          roots.push_back(places[k]);  // it touches zero
        }
      }
      places = std::move(roots);
    }
    return places;
  }

 private:
  static double At(const std::array<double, kDegree + 1>& q, double x) {
    double value = 0;
    for (int k = kDegree; k >= 0; --k) value = value * x + q[static_cast<std::size_t>(k)];
    return value;
  }
  /// Newton's method, bisection where it leaves the bracket or hardly shortens it.
  static double Between(const std::array<double, kDegree + 1>& q, double low, double high,
                        bool rises) {
    double x = 0.5 * (low + high), before = high - low, step = before;
    for (int k = 0; k < kRootSteps; ++k) {
      double value = 0, slope = 0;
      for (int j = kDegree; j >= 0; --j) {
        slope = slope * x + value;
        value = value * x + q[static_cast<std::size_t>(j)];
      }
      if (value == 0) return x;
      ((value < 0) == rises ? low : high) = x;
      double next = x - value / slope;
      if (!(next > low && next < high) || !(std::abs(next - x) < 0.5 * before)) {
        next = 0.5 * (low + high);
      }
      before = step;
      step = std::abs(next - x);
      if (next == x || next == low || next == high) return next;
      x = next;
    }
    return x;
  }
};

}  // namespace

std::vector<Eigen::Vector2d> SlipDirectionsOfOne(const FrictionProblem& problem,
                                                 const FrictionSolution& word, int one) {
  Affine affine;
  if (!Condense(problem, word, one, &affine)) return {};
  const double mu = problem.contacts[static_cast<std::size_t>(one)].coefficient;
  // D y_t of (F5): its values without d, and by d.
  double alpha[2], beta[2][2], size = 0;
  for (int i = 0; i < 2; ++i) {
    const int slip = kSlip1 + i;
    const Minor fixed = MinorOf(affine, {kNormalRate, kForce1, kForce2, slip});
    const Minor first = MinorOf(affine, {kNormalRate, kNormalForce, kForce2, slip});
    const Minor second = MinorOf(affine, {kNormalRate, kForce1, kNormalForce, slip});
    alpha[i] = fixed.value;
    beta[i][0] = mu * first.value;
    beta[i][1] = mu * second.value;
    size += fixed.size + mu * (first.size + second.size);
  }
  if (!(size > 0) || !std::isfinite(size)) return {};
  const Minor fixed = MinorOf(affine, {kNormalRate, kForce1, kForce2, kOne});
  const Minor first = MinorOf(affine, {kNormalRate, kNormalForce, kForce2, kOne});
  const Minor second = MinorOf(affine, {kNormalRate, kForce1, kNormalForce, kOne});
  const double rounding = kTouches * std::numeric_limits<double>::epsilon();
  const double no_force = rounding * (fixed.size + mu * (first.size + second.size));
  // F (1 + x²)² with d = ±(1 − x², 2 x) / (1 + x²), each of half the circle.
  const double turn = 2 * (beta[1][1] - beta[0][0]);
  std::vector<Eigen::Vector2d> found;
  for (const double side : {1.0, -1.0}) {
    Quartic quartic;
    const double a = side * alpha[0], b = side * alpha[1];
    quartic.p = {b + beta[1][0], turn - 2 * a, -4 * beta[0][1] - 2 * beta[1][0], -turn - 2 * a,
                 beta[1][0] - b};
    quartic.left = 4 * (a - beta[0][1]);
    quartic.right = -4 * (a + beta[0][1]);
    quartic.rounding = rounding * size;
    for (double x : quartic.Roots()) {
      const Eigen::Vector2d d = side / (1 + x * x) * Eigen::Vector2d((1 - x) * (1 + x), 2 * x);
      const double D = fixed.value + mu * (d(0) * first.value + d(1) * second.value);
      if (std::abs(D) > no_force) found.push_back(d);
    }
  }
  return found;
}

}  // namespace contact_flow
