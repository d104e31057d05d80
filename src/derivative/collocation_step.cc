// SPDX-License-Identifier: BSD-3-Clause
#include "collocation_step.h"

#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

constexpr int kMaxIterations = 60;
/// Iteration that gains less than this a round costs more than a factorization.
constexpr double kSlow = 0.5;
/// Changes below these parts of the largest entry are rounding: at once, and where they stop
/// to fall.
constexpr double kAtOnce = 4e-16, kStalled = 1e-13;

/// Whether an iteration goes on, by the sizes of its changes.
class Convergence {
 public:
  enum class Verdict { kGoOn, kDone, kFailed };
  Verdict Note(double change, double size) {
    if (!std::isfinite(change)) return Verdict::kFailed;
    if (change <= kAtOnce * size) return Verdict::kDone;
    const bool falls = change <= kSlow * last_;
    last_ = change;
    if (++rounds_ < 3 || (falls && rounds_ < kMaxIterations)) return Verdict::kGoOn;
    return change <= kStalled * size ? Verdict::kDone : Verdict::kFailed;
  }

 private:
  double last_ = std::numeric_limits<double>::infinity();
  int rounds_ = 0;
};

}  // namespace

CollocationStep::CollocationStep(int d, int k, const CollocationRule& rule, double h)
    : d_(d),
      k_(k),
      rule_(&rule),
      h_(h),
      nodes_(d, 2 * d * rule.stages),
      sources_(d, k * rule.stages) {}

const Eigen::PartialPivLU<Matrix>& CollocationStep::Factor() const {
  if (factor_) return *factor_;
  const int s = rule_->stages;
  Matrix system = Matrix::Identity(s * d_, s * d_);
  for (int i = 0; i < s; ++i) {
    const auto K = nodes_.middleCols(2 * d_ * i, d_), D = nodes_.middleCols(2 * d_ * i + d_, d_);
    for (int j = 0; j < s; ++j) {
      system.block(i * d_, j * d_, d_, d_) -=
          h_ * h_ * rule_->twice(i, j) * K + h_ * rule_->a(i, j) * D;
    }
  }
  factor_ = std::make_shared<const Eigen::PartialPivLU<Matrix>>(system);
  return *factor_;
}

Matrix CollocationStep::Accelerations(const Matrix& accelerations, const Vector& weights) const {
  const Eigen::Index c = accelerations.cols() / rule_->stages;
  Matrix sum(d_, c);
  Eigen::Map<Vector>(sum.data(), d_ * c).noalias() =
      Eigen::Map<const Matrix>(accelerations.data(), d_ * c, rule_->stages).lazyProduct(weights);
  return sum;
}

Matrix CollocationStep::Tangents(const Matrix& w, const Matrix& accelerations, double at,
                                 const Vector& once, const Vector& twice) const {
  Matrix tangents = w.topRows(2 * d_);
  tangents.topRows(d_) += at * h_ * w.middleRows(d_, d_);
  tangents.topRows(d_) += h_ * h_ * Accelerations(accelerations, twice);
  tangents.bottomRows(d_) += h_ * Accelerations(accelerations, once);
  return tangents;
}

void CollocationStep::Advance(Matrix* w, const Matrix& accelerations) const {
  w->topRows(2 * d_) = Tangents(*w, accelerations, 1, rule_->b, rule_->twice_end);
}

bool CollocationStep::Solve(const Matrix& w, Matrix* accelerations) const {
  const int s = rule_->stages;
  const Eigen::Index c = w.cols();
  const auto q = w.topRows(d_), v = w.middleRows(d_, d_);
  Matrix given(d_, s * c);  // that does not depend on accelerations
  Matrix tangents(2 * d_, c);
  for (int i = 0; i < s; ++i) {
    tangents << q + rule_->c(i) * h_ * v, v;
    auto own = given.middleCols(i * c, c);
    own.noalias() = nodes_.middleCols(2 * d_ * i, 2 * d_).lazyProduct(tangents);
    if (k_ > 0) own.noalias() += sources_.middleCols(k_ * i, k_).lazyProduct(w.bottomRows(k_));
  }
  Matrix& Y = *accelerations;
  const auto solve = [&] {
    Matrix rows(s * d_, c);
    for (int i = 0; i < s; ++i) rows.middleRows(i * d_, d_) = given.middleCols(i * c, c);
    rows = Factor().solve(rows);
    Y.resize(d_, s * c);
    for (int i = 0; i < s; ++i) Y.middleCols(i * c, c) = rows.middleRows(i * d_, d_);
    return Y.allFinite();
  };
  if (factor_ || s * d_ <= kDirect) return solve();
  Y = given;
  Matrix next(d_, s * c), once(d_, s * c), twice(d_, s * c);
  const auto flat = [&](Matrix& m) { return Eigen::Map<Matrix>(m.data(), d_ * c, s); };
  Convergence convergence;
  for (;;) {
    flat(twice).noalias() = h_ * h_ * flat(Y).lazyProduct(rule_->twice.transpose());
    flat(once).noalias() = h_ * flat(Y).lazyProduct(rule_->a.transpose());
    for (int i = 0; i < s; ++i) {
      tangents << twice.middleCols(i * c, c), once.middleCols(i * c, c);
      next.middleCols(i * c, c).noalias() =
          nodes_.middleCols(2 * d_ * i, 2 * d_).lazyProduct(tangents);
    }
    next += given;
    const double change = (next - Y).cwiseAbs().maxCoeff();
    Y.swap(next);
    const auto verdict = convergence.Note(change, Y.cwiseAbs().maxCoeff());
    if (verdict == Convergence::Verdict::kDone) return true;
    if (verdict == Convergence::Verdict::kFailed) return solve();
  }
}

bool CollocationStep::Retreat(Vector* lambda) const {
  const int s = rule_->stages;
  const auto q = lambda->head(d_), v = lambda->segment(d_, d_);
  // Multipliers μ_j of the accelerations and θ_i of the tangents at the nodes:
  //   θ_i = g_i + [K_i D_i]ᵀ μ_i,
  //   μ_j = h² twice_j λ_q + h b_j λ_v + Σ_i h² (a²)_ij θ_q,i + h a_ij θ_v,i.
  Matrix theta = cost_.size() > 0 ? cost_ : Matrix(Matrix::Zero(2 * d_, s));
  Matrix given = h_ * h_ * q * rule_->twice_end.transpose() + h_ * v * rule_->b.transpose();
  const auto respond = [&](const Matrix& nodes) {
    return Matrix(h_ * h_ * nodes.topRows(d_).lazyProduct(rule_->twice) +
                  h_ * nodes.bottomRows(d_).lazyProduct(rule_->a));
  };
  if (cost_.size() > 0) given += respond(cost_);
  Matrix mu = given;
  const auto solve = [&] {
    Eigen::Map<Vector> rows(mu.data(), s * d_);
    rows = Factor().transpose().solve(Vector(Eigen::Map<const Vector>(given.data(), s * d_)));
    return mu.allFinite();
  };
  const auto push = [&](Matrix* nodes) {  // [K D]ᵀ μ
    for (int i = 0; i < s; ++i) {
      nodes->col(i).noalias() = nodes_.middleCols(2 * d_ * i, 2 * d_).transpose() * mu.col(i);
    }
  };
  bool solved = true;
  if (factor_ || s * d_ <= kDirect) {
    solved = solve();
  } else {
    Matrix pushed(2 * d_, s);
    Convergence convergence;
    for (;;) {
      push(&pushed);
      Matrix next = given + respond(pushed);
      const double change = (next - mu).cwiseAbs().maxCoeff();
      mu.swap(next);
      const auto verdict = convergence.Note(change, mu.cwiseAbs().maxCoeff());
      if (verdict == Convergence::Verdict::kDone) break;
      if (verdict == Convergence::Verdict::kGoOn) continue;
      solved = solve();
      break;
    }
  }
  if (!solved) return false;
  Matrix pushed(2 * d_, s);
  push(&pushed);
  theta += pushed;
  const Vector by_position = theta.topRows(d_).rowwise().sum();
  Vector by_velocity = h_ * (q + theta.topRows(d_) * rule_->c);
  by_velocity += theta.bottomRows(d_).rowwise().sum();
  lambda->head(d_) += by_position;
  lambda->segment(d_, d_) += by_velocity;
  for (int i = 0; i < s && k_ > 0; ++i) {
    lambda->tail(k_).noalias() += sources_.middleCols(k_ * i, k_).transpose() * mu.col(i);
  }
  return true;
}

}  // namespace contact_flow
