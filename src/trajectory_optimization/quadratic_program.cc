// SPDX-License-Identifier: BSD-3-Clause
#include "quadratic_program.h"

#include <Eigen/Jacobi>
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
/// A normal whose part outside the active ones is below this, relative, depends on them.
constexpr double kDependent = 1e-11;
/// Violations below this part of the terms of a constraint are rounding; where a constraint depends
/// on the active ones, of the terms that the steps so far have had.
constexpr double kMet = 1e-12;
/// Active sets that are tried, for each constraint.
constexpr int kRounds = 50;

/// Constraints are numbered: rows of A, lower bounds, upper bounds.
class DualActiveSet {
 public:
  explicit DualActiveSet(const QuadraticProgram& program)
      : program_(program), n_(program.g.size()), m_(program.A.rows()) {
    J_ = program.H.matrixU().solve(Matrix::Identity(n_, n_));
    R_ = Matrix::Zero(n_, n_);
    d_ = -program.H.solve(program.g);
    farthest_ = d_.cwiseAbs();
    sign_.assign(static_cast<std::size_t>(m_), 1);
    active_at_.assign(static_cast<std::size_t>(m_ + 2 * n_), false);
  }

  std::optional<QuadraticSolution> Run(QuadraticFailure* why) {
    *why = QuadraticFailure::kNotFinite;
    if (!d_.allFinite() || !J_.allFinite()) return {};
    *why = QuadraticFailure::kContradiction;
    for (Eigen::Index k = 0; k < n_; ++k) {
      if (!Fixed(k)) continue;
      if (!Activate(Value(m_ + k) < 0 ? m_ + k : m_ + n_ + k)) return {};
    }
    for (Eigen::Index i = 0; i < m_; ++i) {
      if (!program_.equal[static_cast<std::size_t>(i)]) continue;
      if (Value(i) > 0) sign_[static_cast<std::size_t>(i)] = -1;
      const bool met = std::abs(Value(i)) <= kMet * std::max(Terms(i), FarthestTerms(i));
      if (!Activate(i) && !met) return {};
    }
    const long limit = kRounds * static_cast<long>(m_ + 2 * n_) + 100;
    for (long round = 0; round < limit; ++round) {
      AskBudget();
      const Eigen::Index worst = MostViolated();
      if (worst < 0) {
        *why = QuadraticFailure::kNotFinite;
        return Take();
      }
      if (!Activate(worst)) return {};
    }
    *why = QuadraticFailure::kUnfinished;
    return {};
  }

 private:
  Vector Normal(Eigen::Index i) const {
    if (i < m_) return sign_[static_cast<std::size_t>(i)] * program_.A.row(i).transpose();
    const Eigen::Index k = (i - m_) % n_;
    return Vector::Unit(n_, k) * (i < m_ + n_ ? 1.0 : -1.0);
  }
  /// What must not be negative.
  double Value(Eigen::Index i) const {
    if (i < m_) {
      return sign_[static_cast<std::size_t>(i)] * (program_.A.row(i).dot(d_) + program_.b(i));
    }
    const Eigen::Index k = (i - m_) % n_;
    return i < m_ + n_ ? d_(k) - program_.lower(k) : program_.upper(k) - d_(k);
  }
  double Terms(Eigen::Index i) const { return TermsOf(i, d_.cwiseAbs()); }
  double FarthestTerms(Eigen::Index i) const { return TermsOf(i, farthest_); }
  double TermsOf(Eigen::Index i, const Vector& size) const {
    if (i < m_) return program_.A.row(i).cwiseAbs().dot(size) + std::abs(program_.b(i));
    const Eigen::Index k = (i - m_) % n_;
    const double bound = i < m_ + n_ ? program_.lower(k) : program_.upper(k);
    return size(k) + (std::isfinite(bound) ? std::abs(bound) : 0);
  }
  /// Whether both bounds of entry k are one number.
  bool Fixed(Eigen::Index k) const { return program_.lower(k) == program_.upper(k); }
  bool Equality(Eigen::Index i) const {
    return i < m_ ? program_.equal[static_cast<std::size_t>(i)] : Fixed((i - m_) % n_);
  }
  bool Depends(Eigen::Index i) const {
    const Vector along = J_.transpose() * Normal(i);
    const double free = along.tail(n_ - static_cast<Eigen::Index>(active_.size())).squaredNorm();
    return free <= kDependent * kDependent * along.squaredNorm();
  }

  /// By the distance in the metric of H; −1 where all are met.
  Eigen::Index MostViolated() const {
    Eigen::Index worst = -1;
    double largest = 0;
    for (Eigen::Index i = 0; i < m_ + 2 * n_; ++i) {
      if (active_at_[static_cast<std::size_t>(i)] || Equality(i)) continue;
      const double value = Value(i);
      if (!(value < -kMet * Terms(i))) continue;
      if (value >= -kMet * FarthestTerms(i) && Depends(i)) continue;
      const double reach = i < m_ ? (J_.transpose() * program_.A.row(i).transpose()).norm()
                                  : J_.row((i - m_) % n_).norm();
      const double distance = -value / std::max(reach, 1e-300);
      if (distance > largest) {
        largest = distance;
        worst = i;
      }
    }
    return worst;
  }

  /// Makes constraint i active, which is not; false where the active ones contradict it.
  bool Activate(Eigen::Index i) {
    const Vector normal = Normal(i);
    double multiplier = 0;
    for (;;) {
      AskBudget();
      const auto q = static_cast<Eigen::Index>(active_.size());
      Vector along = J_.transpose() * normal;
      const Vector answer =
          R_.topLeftCorner(q, q).triangularView<Eigen::Upper>().solve(along.head(q));
      const double free = along.tail(n_ - q).squaredNorm();
      const bool depends = free <= kDependent * kDependent * along.squaredNorm();
      // The longest step that keeps all multipliers, and the one that meets the constraint.
      double dual = kUnbounded;
      Eigen::Index first = -1;
      for (Eigen::Index k = 0; k < q; ++k) {
        if (Equality(active_[k]) || !(answer(k) > 0)) continue;
        const double length = multipliers_[k] / answer(k);
        if (length < dual) {
          dual = length;
          first = k;
        }
      }
      const double primal = depends ? kUnbounded : std::max(0.0, -Value(i)) / free;
      const double step = std::min(dual, primal);
      if (!std::isfinite(step)) return false;
      if (!depends) d_ += step * (J_.rightCols(n_ - q) * along.tail(n_ - q));
      farthest_ = farthest_.cwiseMax(d_.cwiseAbs());
      for (Eigen::Index k = 0; k < q; ++k) multipliers_[k] -= step * answer(k);
      multiplier += step;
      if (step == primal) {
        Add(i, multiplier, &along);
        return true;
      }
      Drop(first);
    }
  }

  void Add(Eigen::Index i, double multiplier, Vector* along) {
    const auto q = static_cast<Eigen::Index>(active_.size());
    Eigen::JacobiRotation<double> rotation;
    for (Eigen::Index k = n_ - 1; k > q; --k) {
      double r;
      rotation.makeGivens((*along)(k - 1), (*along)(k), &r);
      (*along)(k - 1) = r;
      (*along)(k) = 0;
      J_.applyOnTheRight(k - 1, k, rotation);
    }
    R_.col(q).head(q + 1) = along->head(q + 1);
    active_.push_back(i);
    multipliers_.push_back(multiplier);
    active_at_[static_cast<std::size_t>(i)] = true;
  }

  void Drop(Eigen::Index place) {
    const auto q = static_cast<Eigen::Index>(active_.size());
    active_at_[static_cast<std::size_t>(active_[place])] = false;
    active_.erase(active_.begin() + place);
    multipliers_.erase(multipliers_.begin() + place);
    for (Eigen::Index k = place; k + 1 < q; ++k) R_.col(k).head(q) = R_.col(k + 1).head(q).eval();
    Eigen::JacobiRotation<double> rotation;
    for (Eigen::Index k = place; k + 1 < q; ++k) {
      rotation.makeGivens(R_(k, k), R_(k + 1, k));
      R_.applyOnTheLeft(k, k + 1, rotation.adjoint());
      R_(k + 1, k) = 0;
      J_.applyOnTheRight(k, k + 1, rotation);
    }
  }

  std::optional<QuadraticSolution> Take() const {
    QuadraticSolution solution;
    solution.d = d_;
    solution.multipliers = Vector::Zero(m_);
    solution.bounded.assign(static_cast<std::size_t>(n_), false);
    for (std::size_t k = 0; k < active_.size(); ++k) {
      const Eigen::Index i = active_[k];
      if (i < m_) {
        solution.multipliers(i) = sign_[static_cast<std::size_t>(i)] * multipliers_[k];
        continue;
      }
      const Eigen::Index entry = (i - m_) % n_;
      solution.bounded[static_cast<std::size_t>(entry)] = true;
      solution.d(entry) = i < m_ + n_ ? program_.lower(entry) : program_.upper(entry);
    }
    if (!solution.d.allFinite()) return {};
    return solution;
  }

  const QuadraticProgram& program_;
  const Eigen::Index n_, m_;
  Matrix J_;  // L⁻ᵀ Q: normals of the active set are J⁻ᵀ [R; 0]
  Matrix R_;
  Vector d_;
  Vector farthest_;           // the largest |d| on the way [n]
  std::vector<double> sign_;  // of equalities, so that they are violated to the negative side
  std::vector<Eigen::Index> active_;
  std::vector<double> multipliers_;
  std::vector<bool> active_at_;
};

}  // namespace

std::optional<QuadraticSolution> Solve(const QuadraticProgram& program, QuadraticFailure* why) {
  QuadraticFailure failure;
  return DualActiveSet(program).Run(why != nullptr ? why : &failure);
}

}  // namespace contact_flow
