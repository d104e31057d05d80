// SPDX-License-Identifier: BSD-3-Clause
#include "equal_springs.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "dependent_rows.h"

namespace contact_flow {
namespace {

/// Springs relative to G, from soft to stiff: forces are known to about 1e-16/ε.
constexpr double kSoftest = 1, kStiffest = 1e-6;
struct Way {
  double step;     // r, times the largest entry of a contact's G
  double stiffer;  // factor of ε
  int sweeps;      // λ ← proj(λ − r y), past a kink from which Newton finds no descent
};
constexpr Way kWays[] = {{1, 0.1, 0},    {0.2, 0.3, 0},   {5, 0.3, 0},  {1, 0.7, 0},
                         {0.05, 0.7, 0}, {30, 0.7, 0},    {5, 0.3, 20}, {0.2, 0.3, 20},
                         {1, 0.7, 20},   {0.05, 0.7, 20}, {30, 0.7, 20}};
constexpr int kNewtonSteps = 100;
constexpr double kLeastSpring = 1e-6;
/// Residuals below this are rounding, relative; larger ones than the second are none that count.
constexpr double kConverged = 1e-14, kSpringsSolved = 1e-9;
/// Of the limit of a word: its equations are singular below this pivot, and its motion is that of
/// the springs found up to this, relative.
constexpr double kSpringPivot = 1e-9, kSameSprings = 1e-8;

/// The residual λ − proj(λ − r y) and its Jacobian.
class Springs {
 public:
  Springs(const FrictionProblem& problem, const Way& way) : problem_(problem), way_(way) {
    G_ = problem.G;
    mean_ = problem.G.diagonal().mean();
    for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
      rows_.push_back(problem.Row(i));
      const int count = 1 + problem.contacts[i].dimension;
      step_.push_back(way.step / problem.G.diagonal().segment(rows_.back(), count).maxCoeff());
    }
    size_ = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const int count = 1 + problem.contacts[i].dimension;
      size_ = std::max(size_, step_[i] * problem.b.segment(rows_[i], count).cwiseAbs().maxCoeff());
    }
  }

  /// Newton's method for these springs, from *force on.
  bool Solve(double softness, Vector* force) {
    G_ = problem_.G;
    G_.diagonal().array() += softness * mean_;
    Vector residual = Residual(*force, &jacobian_);
    for (int k = 0; k < kNewtonSteps; ++k) {
      if (residual.lpNorm<Eigen::Infinity>() <= kConverged * size_) return true;
      const Vector change = -jacobian_.partialPivLu().solve(residual);
      if (!change.allFinite()) return false;
      double part = 1;
      Vector next, moved;
      do {
        moved = *force + part * change;
        next = Residual(moved, nullptr);
        part *= 0.5;
      } while (!(next.norm() < (1 - 1e-4 * part) * residual.norm()) && part > kLeastSpring);
      if (next.norm() < residual.norm()) {
        *force = moved;
      } else if (way_.sweeps > 0) {
        for (int sweep = 0; sweep < way_.sweeps; ++sweep) *force -= Residual(*force, nullptr);
      } else {
        break;
      }
      residual = Residual(*force, &jacobian_);
    }
    return residual.lpNorm<Eigen::Infinity>() <= kSpringsSolved * size_;
  }

  FrictionSolution Solution(const Vector& force) const {
    FrictionSolution solution;
    solution.force = force;
    solution.result = problem_.G * force + problem_.b;
    solution.springs = true;
    const Vector y = G_ * force + problem_.b;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const FrictionContact& contact = problem_.contacts[i];
      const int row = rows_[i], count = contact.dimension;
      Eigen::Vector2d direction = contact.direction;
      Letter letter = Letter::kOpen;
      if (force(row) - step_[i] * y(row) > 0) {
        const Vector trial = force.segment(row + 1, count) - step_[i] * y.segment(row + 1, count);
        const bool sticks =
            count > 0 && !contact.slips && trial.norm() <= contact.coefficient * force(row);
        letter = sticks ? Letter::kStick : Letter::kSlip;
        if (!sticks && count > 0) {
          if (!contact.slips) direction.head(count) = -trial.normalized();
          if (count == 1) letter = direction(0) > 0 ? Letter::kForward : Letter::kBackward;
        }
      }
      solution.letters.push_back(letter);
      solution.directions.push_back(direction);
    }
    return solution;
  }

 private:
  Vector Residual(const Vector& force, Matrix* jacobian) const {
    const Vector y = G_ * force + problem_.b;
    const auto size = force.size();
    Vector residual(size);
    if (jacobian != nullptr) jacobian->setZero(size, size);
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const FrictionContact& contact = problem_.contacts[i];
      const int n = rows_[i], t = n + 1, count = contact.dimension;
      const double r = step_[i];
      // proj of the normal force, and its derivative.
      const double trial = force(n) - r * y(n);
      const double normal = std::max(trial, 0.0);
      residual(n) = force(n) - normal;
      Eigen::RowVectorXd normal_change = Eigen::RowVectorXd::Zero(size);
      if (jacobian != nullptr) {
        if (trial > 0) {
          normal_change = -r * G_.row(n);
          normal_change(n) += 1;
        }
        jacobian->row(n) = -normal_change;
        (*jacobian)(n, n) += 1;
      }
      if (count == 0) continue;
      if (contact.slips) {
        const auto d = contact.direction.head(count);
        residual.segment(t, count) = force.segment(t, count) + contact.coefficient * normal * d;
        if (jacobian == nullptr) continue;
        jacobian->middleRows(t, count) = contact.coefficient * d * normal_change;
        jacobian->block(t, t, count, count) += Matrix::Identity(count, count);
        continue;
      }
      const Vector pull = force.segment(t, count) - r * y.segment(t, count);
      const double length = pull.norm(), radius = contact.coefficient * normal;
      Matrix pull_change;
      if (jacobian != nullptr) {
        pull_change = -r * G_.middleRows(t, count);
        pull_change.middleCols(t, count) += Matrix::Identity(count, count);
      }
      if (normal > 0 && length <= radius) {
        residual.segment(t, count) = r * y.segment(t, count);
        if (jacobian != nullptr) jacobian->middleRows(t, count) = r * G_.middleRows(t, count);
        continue;
      }
      if (!(normal > 0) || !(length > 0)) {
        residual.segment(t, count) = force.segment(t, count);
        if (jacobian != nullptr) {
          jacobian->block(t, t, count, count) = Matrix::Identity(count, count);
        }
        continue;
      }
      const Vector along = pull / length;
      residual.segment(t, count) = force.segment(t, count) - radius * along;
      if (jacobian == nullptr) continue;
      const Matrix turn =
          radius / length * (Matrix::Identity(count, count) - along * along.transpose());
      jacobian->middleRows(t, count) =
          -contact.coefficient * along * normal_change - turn * pull_change;
      jacobian->block(t, t, count, count) += Matrix::Identity(count, count);
    }
    return residual;
  }

  const FrictionProblem& problem_;
  const Way& way_;
  Matrix G_, jacobian_;
  double mean_, size_;
  std::vector<int> rows_;
  std::vector<double> step_;  // r, of a contact
};

}  // namespace

std::optional<FrictionSolution> SolveEqualSprings(const FrictionProblem& problem) {
  // Where Newton's method fails other lengths of the step r, and smaller steps of ε, may do.
  for (const Way& way : kWays) {
    Springs springs(problem, way);
    Vector force = Vector::Zero(problem.b.size());
    bool solved = true;
    double softness = kSoftest;
    while (solved && softness > kStiffest) {
      softness = std::max(kStiffest, softness * way.stiffer);
      solved = springs.Solve(softness, &force);
    }
    if (!solved) continue;
    // What is left is linear in ε.
    Vector softer = force;
    FrictionSolution solution = springs.Solution(force);
    solved = springs.Solve(2 * softness, &softer) &&
             springs.Solution(softer).letters == solution.letters;
    if (!solved) return solution;
    solution.force = 2 * force - softer;
    solution.result = problem.G * solution.force + problem.b;
    for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
      const FrictionContact& contact = problem.contacts[i];
      const auto pull = solution.force.segment(problem.Row(i) + 1, contact.dimension);
      const Letter letter = solution.letters[i];
      const bool slips = letter != Letter::kOpen && letter != Letter::kStick;
      if (slips && !contact.slips && contact.dimension == 2) {
        solution.directions[i] = -pull.normalized();
      }
    }
    return solution;
  }
  return std::nullopt;
}

bool SolveStiffSprings(const FrictionProblem& problem, FrictionSolution* solution) {
  std::vector<int> rows;
  Matrix columns = Matrix::Zero(problem.b.size(), problem.b.size());
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const Letter letter = solution->letters[i];
    if (letter == Letter::kOpen) continue;
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i), held = letter == Letter::kStick ? contact.dimension : 0;
    if (letter != Letter::kStick) {
      columns.block(row + 1, static_cast<Eigen::Index>(rows.size()), contact.dimension, 1) =
          -contact.coefficient * solution->directions[i].head(contact.dimension);
    }
    for (int k = 0; k <= held; ++k) {
      columns(row + k, static_cast<Eigen::Index>(rows.size())) = 1;
      rows.push_back(row + k);
    }
  }
  const auto m = static_cast<Eigen::Index>(rows.size());
  if (m == 0) return false;
  const Matrix W = columns.leftCols(m);
  Matrix block(m, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      block(i, j) = problem.G(rows[static_cast<std::size_t>(i)], rows[static_cast<std::size_t>(j)]);
    }
  }
  const RowBasis basis = FindRowBasis(block);
  const auto r = static_cast<Eigen::Index>(basis.rows.size());
  if (r == m) return false;
  const Vector unit = block.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix push = problem.G * W;
  Matrix equations(m, m);
  Vector right = Vector::Zero(m);
  for (Eigen::Index k = 0; k < r; ++k) {
    const int place = basis.rows[static_cast<std::size_t>(k)];
    const int row = rows[static_cast<std::size_t>(place)];
    equations.row(k) = unit(place) * push.row(row) * unit.asDiagonal();
    right(k) = -unit(place) * problem.b(row);
  }
  equations.bottomRows(m - r) = basis.freedom.transpose() * unit.asDiagonal();
  for (Eigen::Index k = r; k < m; ++k) equations.row(k).normalize();
  Eigen::FullPivLU<Matrix> factor(equations);
  factor.setThreshold(kSpringPivot);
  if (!equations.allFinite() || factor.rank() < m) return false;
  const Vector force = W * (unit.asDiagonal() * factor.solve(right));
  const Vector result = problem.G * force + problem.b;
  const double scale = problem.b.cwiseAbs().maxCoeff();
  if (!((result - solution->result).cwiseAbs().maxCoeff() <= kSameSprings * scale)) return false;
  solution->force = force;
  solution->result = result;
  return true;
}

}  // namespace contact_flow
