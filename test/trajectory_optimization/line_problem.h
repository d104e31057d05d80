// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "contact_flow/types.h"

/// Optimal control of bodies on a line with impacts, in closed form.
namespace contact_flow {
namespace test {

/// Bodies on a line, the first of which a force u drives: m₁ q̈₁ = u + m₁ g, q̈_i = g. At each of
/// several events a gap n·q + c closes, and v⁺ = v − (1 + e) M⁻¹ nᵀ (n v)/(n M⁻¹ nᵀ). For given
/// instants of the events the state is affine in the inputs on a grid, held or led, and the least
///   J = r ∫ u² dt + Σ w (x(T) − target)²,      gaps closed at their instants,
/// is that of a linear system of equations; some of x(T) may be held at their targets.
struct LineProblem {
  struct Event {
    Vector n;  // [bodies]
    double c = 0, e = 1;
  };
  Vector mass;  // [bodies]
  double gravity = 0, duration = 1;
  Vector x;               // (q, v) at the start
  int count = 1;          // intervals
  bool linear = false;    // inputs are led linearly
  double effort = 1;      // r
  Vector weight, target;  // of (q, v) at T
  std::vector<int> held;  // those of (q, v) that are the target at T

  int bodies() const { return static_cast<int>(mass.size()); }
  int inputs() const { return linear ? count + 1 : count; }

  /// The least cost with these events at these instants, in their order; the inputs, too. ∞ where
  /// nothing holds all that is to hold.
  double Cost(const std::vector<Event>& events, const std::vector<double>& instants,
              Vector* inputs_found = nullptr) const {
    const int d = bodies(), m = inputs();
    Matrix X = Matrix::Zero(2 * d, m + 1);  // affine in (u, 1)
    X.col(m) = x;
    Matrix rows = Matrix::Zero(static_cast<Eigen::Index>(events.size() + held.size()), m + 1);
    double t = 0;
    for (std::size_t i = 0; i < events.size(); ++i) {
      Advance(t, instants[i], &X);
      t = instants[i];
      const Event& event = events[i];
      const auto row = static_cast<Eigen::Index>(i);
      rows.row(row) = event.n.transpose() * X.topRows(d);
      rows(row, m) += event.c;
      const Vector push = mass.cwiseInverse().asDiagonal() * event.n;
      const Eigen::RowVectorXd speed = event.n.transpose() * X.bottomRows(d);
      X.bottomRows(d) -= (1 + event.e) / event.n.dot(push) * push * speed;
    }
    Advance(t, duration, &X);
    for (std::size_t i = 0; i < held.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(events.size() + i);
      rows.row(row) = X.row(held[i]);
      rows(row, m) -= target(held[i]);
    }
    // min uᵀRu + |W(Eu + f)|² under A u + b = 0.
    Matrix H = Effort();
    Vector g = Vector::Zero(m);
    double constant = 0;
    for (int i = 0; i < 2 * d; ++i) {
      const Vector e = X.row(i).head(m).transpose();
      const double f = X(i, m) - target(i);
      H += weight(i) * e * e.transpose();
      g += weight(i) * f * e;
      constant += weight(i) * f * f;
    }
    const Eigen::Index k = rows.rows();
    Matrix kkt = Matrix::Zero(m + k, m + k);
    kkt.topLeftCorner(m, m) = H;
    kkt.topRightCorner(m, k) = rows.leftCols(m).transpose();
    kkt.bottomLeftCorner(k, m) = rows.leftCols(m);
    Vector right(m + k);
    right << -g, -rows.col(m);
    // Rows may depend on each other: who is stopped at its goal stays there.
    const Vector all = held.empty() ? Vector(kkt.fullPivLu().solve(right))
                                    : Vector(kkt.completeOrthogonalDecomposition().solve(right));
    const Vector u = all.head(m);
    const Vector off = rows.leftCols(m) * u + rows.col(m);
    if (!held.empty() && !(off.cwiseAbs().maxCoeff() < 1e-9)) {
      return std::numeric_limits<double>::infinity();
    }
    if (inputs_found != nullptr) *inputs_found = u;
    return u.dot(H * u) + 2 * g.dot(u) + constant;
  }

  /// The least over one instant between `low` and `high`, cell by cell of the grid, in each of
  /// which it is taken to have one minimum.
  double Best(const Event& event, double low, double high, double* at = nullptr) const {
    double best = std::numeric_limits<double>::infinity();
    const double h = duration / count;
    for (int k = 0; k < count; ++k) {
      double a = std::max(low, k * h), b = std::min(high, (k + 1) * h);
      if (!(a < b)) continue;
      const auto cost = [&](double s) { return Cost({event}, {s}); };
      const double golden = (std::sqrt(5.0) - 1) / 2;
      double c = b - golden * (b - a), d = a + golden * (b - a), fc = cost(c), fd = cost(d);
      while (b - a > 1e-10) {
        if (fc < fd) {
          b = d, d = c, fd = fc, c = b - golden * (b - a), fc = cost(c);
        } else {
          a = c, c = d, fc = fd, d = a + golden * (b - a), fd = cost(d);
        }
      }
      for (double s : {a, b, (a + b) / 2}) {
        if (cost(s) >= best) continue;
        best = cost(s);
        if (at != nullptr) *at = s;
      }
    }
    return best;
  }

 private:
  /// R of r ∫ u² dt.
  Matrix Effort() const {
    const double h = duration / count;
    if (!linear) return effort * h * Matrix::Identity(count, count);
    Matrix R = Matrix::Zero(count + 1, count + 1);
    for (int k = 0; k < count; ++k) {
      R(k, k) += effort * h / 3;
      R(k + 1, k + 1) += effort * h / 3;
      R(k, k + 1) += effort * h / 6;
      R(k + 1, k) += effort * h / 6;
    }
    return R;
  }

  /// From t to s without events: by the rule of Gauss and Legendre with two nodes, which is exact
  /// for (s − τ) u(τ).
  void Advance(double t, double s, Matrix* X) const {
    const int d = bodies(), m = inputs();
    const double length = s - t;
    X->topRows(d) += length * X->bottomRows(d);
    for (int i = 0; i < d; ++i) {
      (*X)(i, m) += gravity * length * length / 2;
      (*X)(d + i, m) += gravity * length;
    }
    const double h = duration / count;
    for (int k = 0; k < count; ++k) {
      const double a = std::max(t, k * h), b = std::min(s, (k + 1) * h);
      if (!(a < b)) continue;
      for (double node : {0.5 - std::sqrt(3.0) / 6, 0.5 + std::sqrt(3.0) / 6}) {
        const double at = a + node * (b - a), part = (b - a) / 2 / mass(0);
        const double share = linear ? at / h - k : 0;
        (*X)(0, k) += part * (s - at) * (1 - share);
        (*X)(d, k) += part * (1 - share);
        if (!linear) continue;
        (*X)(0, k + 1) += part * (s - at) * share;
        (*X)(d, k + 1) += part * share;
      }
    }
  }
};

}  // namespace test
}  // namespace contact_flow
