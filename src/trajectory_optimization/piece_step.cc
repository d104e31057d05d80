// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/trajectory_optimization/piece_step.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "contact_flow/budget.h"
#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

constexpr int kMaxBoundChanges = 100;
/// A gradient at a bound below this part of the largest does not leave it.
constexpr double kNoise = 1e-12;
/// Pivots of H below this part of the largest are rounding; H is then lifted by this part.
constexpr double kSingular = 1e-13, kLift = 1e-9;

/// The problem in the unknowns that are off their bounds.
class Reduced {
 public:
  Reduced(const PieceModel& piece, const Matrix& H, const std::vector<int>& rows,
          const std::vector<bool>& is_equal, const std::vector<bool>& fixed, const Vector& d)
      : piece_(piece), H_(H), rows_(rows), is_equal_(is_equal) {
    for (std::size_t i = 0; i < fixed.size(); ++i) {
      if (!fixed[i]) free_.push_back(static_cast<Eigen::Index>(i));
    }
    start_ = d;
    for (Eigen::Index i : free_) start_(i) = 0;
  }

  /// d with its free entries, and z; false where there is none.
  bool Solve(Vector* d, Vector* z) const {
    const auto n = static_cast<Eigen::Index>(free_.size());
    const auto h = static_cast<Eigen::Index>(rows_.size());
    *d = start_;
    *z = Vector::Zero(static_cast<Eigen::Index>(piece_.orders.size()));
    if (n == 0) return true;
    Matrix H(n, n);
    const Vector moved = piece_.gradient + H_ * start_;
    Vector g(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      g(i) = moved(free_[i]);
      for (Eigen::Index j = 0; j < n; ++j) H(i, j) = H_(free_[i], free_[j]);
    }
    const Eigen::LLT<Matrix> factor = FactorOf(H);
    if (factor.info() != Eigen::Success) return false;
    Vector step = -factor.solve(g);
    if (h > 0) {
      Matrix A(h, n);
      Vector slack(h);
      for (Eigen::Index r = 0; r < h; ++r) {
        const OrderRow& order = piece_.orders[static_cast<std::size_t>(rows_[r])];
        for (Eigen::Index i = 0; i < n; ++i) A(r, i) = order.row(free_[i]);
        slack(r) = order.slack + order.row.dot(start_);
      }
      // An equality is two inequalities. In units in which each row moves by 1.
      Eigen::Index size = h;
      for (bool equal : is_equal_) size += equal;
      Matrix B(size, n);
      Vector b(size);
      B.topRows(h) = A;
      b.head(h) = slack;
      Eigen::Index next = h;
      for (Eigen::Index r = 0; r < h; ++r) {
        if (!is_equal_[r]) continue;
        B.row(next) = -A.row(r);
        b(next++) = -slack(r);
      }
      const Matrix reach = factor.solve(B.transpose());
      Matrix G = B * reach;
      const Vector scale = G.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
      G = (scale.asDiagonal() * G * scale.asDiagonal()).eval();
      const Vector q = scale.asDiagonal() * (b + B * step);
      const std::optional<ComplementaritySolution> found =
          SolveComplementarity(0.5 * (G + G.transpose()), q);
      if (!found) return false;
      const Vector multipliers = scale.asDiagonal() * found->z;
      step += reach * multipliers;
      next = h;
      for (Eigen::Index r = 0; r < h; ++r) {
        (*z)(rows_[r]) = multipliers(r);
        if (is_equal_[r]) (*z)(rows_[r]) -= multipliers(next++);
      }
    }
    for (Eigen::Index i = 0; i < n; ++i) (*d)(free_[i]) = step(i);
    return d->allFinite();
  }

 private:
  const PieceModel& piece_;
  const Matrix& H_;
  const std::vector<int>& rows_;
  const std::vector<bool>& is_equal_;
  std::vector<Eigen::Index> free_;
  Vector start_;
};

}  // namespace

Eigen::LLT<Matrix> FactorOf(const Matrix& H) {
  AskBudget();
  Eigen::LLT<Matrix> factor(H);
  const double largest = H.diagonal().cwiseAbs().maxCoeff();
  const auto pivots = factor.matrixLLT().diagonal().array().square();
  const bool regular =
      factor.info() == Eigen::Success && pivots.minCoeff() > kSingular * pivots.maxCoeff();
  if (regular || !std::isfinite(largest)) return factor;
  Matrix lifted = H;
  lifted.diagonal().array() += largest > 0 ? kLift * largest : 1;
  factor.compute(lifted);
  return factor;
}

PieceStep SolvePiece(const PieceModel& piece, const Vector& y, const Vector& lower,
                     const Vector& upper, OrderRule rule, const std::vector<int>& equal,
                     double damping) {
  const Eigen::Index n = y.size();
  Matrix H = piece.hessian;
  H.diagonal().array() += damping;
  std::vector<int> rows;
  std::vector<bool> is_equal;
  for (std::size_t r = 0; r < piece.orders.size(); ++r) {
    const bool is = std::count(equal.begin(), equal.end(), static_cast<int>(r)) > 0;
    if (!is && rule == OrderRule::kIgnore) continue;
    rows.push_back(static_cast<int>(r));
    is_equal.push_back(is);
  }
  PieceStep step;
  step.bounded.assign(static_cast<std::size_t>(n), false);
  step.d = Vector::Zero(n);
  std::vector<bool>& fixed = step.bounded;
  for (int change = 0; change < kMaxBoundChanges; ++change) {
    AskBudget();
    Vector d;
    if (!Reduced(piece, H, rows, is_equal, fixed, step.d).Solve(&d, &step.multipliers)) return step;
    Vector force = piece.gradient + H * d;
    for (int r : rows) {
      force -= step.multipliers(r) * piece.orders[static_cast<std::size_t>(r)].row.transpose();
    }
    const double noise = kNoise * (1 + piece.gradient.cwiseAbs().maxCoeff());
    bool changed = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto place = static_cast<std::size_t>(i);
      if (!fixed[place] && (y(i) + d(i) < lower(i) || y(i) + d(i) > upper(i))) {
        d(i) = y(i) + d(i) < lower(i) ? lower(i) - y(i) : upper(i) - y(i);
        fixed[place] = changed = true;
      } else if (fixed[place]) {  // pushed off its bound: free again
        const bool low = y(i) + d(i) <= lower(i);
        const bool leaves = lower(i) < upper(i) && (low ? force(i) < -noise : force(i) > noise);
        if (!leaves) continue;
        fixed[place] = false;
        changed = true;
      }
    }
    step.d = d;
    if (changed) continue;
    step.residual = 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!fixed[static_cast<std::size_t>(i)]) {
        step.residual = std::max(step.residual, std::abs(force(i)));
      }
    }
    step.decrease = -(piece.gradient.dot(d) + 0.5 * d.dot(piece.hessian * d));
    step.solved = true;
    return step;
  }
  return step;
}

}  // namespace contact_flow
