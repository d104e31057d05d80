// SPDX-License-Identifier: BSD-3-Clause
#include "slip_newton.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace contact_flow {
namespace {

constexpr int kPolishSteps = 12;
/// What is left of the equations is rounding below this, in units of their terms; where that is
/// more than the second, relative to b, nothing is known of the motion.
constexpr double kEquationRounding = 64 * std::numeric_limits<double>::epsilon();
constexpr double kNothingKnown = 1e-2;

Eigen::Vector2d LeftOf(const Eigen::Vector2d& d) { return {-d(1), d(0)}; }

/// The equations at some multipliers and directions, in units of the rows.
class SlipEquations {
 public:
  SlipEquations(const FrictionProblem& problem, const std::vector<int>& unknown,
                const FrictionSolution& word)
      : problem_(problem), unknown_(unknown), held_(problem, word, {}) {
    unit_ = problem.G.diagonal().cwiseSqrt().cwiseInverse();
    held_count_ = static_cast<Eigen::Index>(held_.rows.size());
    size_ = held_count_ + static_cast<Eigen::Index>(unknown.size());
  }

  /// What is left of them, and their derivative by m, in units of the rows, and by the angles.
  Vector Residual(const FrictionSolution& s, Matrix* jacobian) {
    const Matrix& G = problem_.G;
    Turn(s);
    const Vector y = G * s.force + problem_.b;
    Vector residual(size_);
    for (Eigen::Index r = 0; r < held_count_; ++r) {
      const int row = held_.rows[static_cast<std::size_t>(r)];
      residual(r) = unit_(row) * y(row);
    }
    for (Eigen::Index k = 0; k < size_ - held_count_; ++k) {
      const int row = Tangential(k);
      residual(held_count_ + k) = unit_(row) * LeftOf(Direction(s, k)).dot(y.segment<2>(row));
    }
    if (jacobian == nullptr) return residual;
    jacobian->resize(size_, size_);
    Matrix change(G.rows(), size_);  // of y
    change.leftCols(held_count_) = G * held_.columns;
    for (Eigen::Index r = 0; r < held_count_; ++r) {
      change.col(r) *= unit_(held_.rows[static_cast<std::size_t>(r)]);
    }
    for (Eigen::Index k = 0; k < size_ - held_count_; ++k) {
      const int row = Tangential(k);
      const double pull = -Coefficient(k) * s.force(row - 1);
      change.col(held_count_ + k) = G.middleCols<2>(row) * (pull * LeftOf(Direction(s, k)));
    }
    for (Eigen::Index r = 0; r < held_count_; ++r) {
      const int row = held_.rows[static_cast<std::size_t>(r)];
      jacobian->row(r) = unit_(row) * change.row(row);
    }
    for (Eigen::Index k = 0; k < size_ - held_count_; ++k) {
      const int row = Tangential(k);
      const Eigen::Index at = held_count_ + k;
      jacobian->row(at) =
          unit_(row) * LeftOf(Direction(s, k)).transpose() * change.middleRows<2>(row);
      (*jacobian)(at, at) -= unit_(row) * Direction(s, k).dot(y.segment<2>(row));
    }
    return residual;
  }

  /// Rounding of these equations, and of y in units of the rows.
  double Rounding(const FrictionSolution& s) const {
    const Vector terms = problem_.G.cwiseAbs() * s.force.cwiseAbs() + problem_.b.cwiseAbs();
    return kEquationRounding * unit_.cwiseProduct(terms).maxCoeff();
  }
  /// Whether that leaves digits of y.
  bool IsKnown(const FrictionSolution& s) const {
    return Rounding(s) <= kNothingKnown * unit_.cwiseProduct(problem_.b).cwiseAbs().maxCoeff();
  }

  /// The forces and directions after a step of Newton's method.
  FrictionSolution Moved(const FrictionSolution& s, const Vector& step) {
    FrictionSolution moved = s;
    for (Eigen::Index k = 0; k < size_ - held_count_; ++k) {
      Eigen::Vector2d& d = moved.directions[Contact(k)];
      d = (d + step(held_count_ + k) * LeftOf(d)).normalized();
    }
    Turn(moved);
    Vector m(held_count_);
    for (Eigen::Index r = 0; r < held_count_; ++r) {
      const int row = held_.rows[static_cast<std::size_t>(r)];
      m(r) = s.force(row) + unit_(row) * step(r);
    }
    moved.force = held_.columns * m;
    return moved;
  }

 private:
  std::size_t Contact(Eigen::Index k) const {
    return static_cast<std::size_t>(unknown_[static_cast<std::size_t>(k)]);
  }
  int Tangential(Eigen::Index k) const { return problem_.Row(Contact(k)) + 1; }
  double Coefficient(Eigen::Index k) const { return problem_.contacts[Contact(k)].coefficient; }
  const Eigen::Vector2d& Direction(const FrictionSolution& s, Eigen::Index k) const {
    return s.directions[Contact(k)];
  }
  /// The columns for the directions of s.
  void Turn(const FrictionSolution& s) {
    for (Eigen::Index k = 0; k < size_ - held_count_; ++k) {
      const int row = Tangential(k);
      const auto at = std::find(held_.rows.begin(), held_.rows.end(), row - 1);
      held_.columns.block<2, 1>(row, at - held_.rows.begin()) = -Coefficient(k) * Direction(s, k);
    }
  }

  const FrictionProblem& problem_;
  const std::vector<int>& unknown_;
  HeldEquations held_;
  Vector unit_;
  Eigen::Index held_count_, size_;
};

}  // namespace

HeldEquations::HeldEquations(const FrictionProblem& problem, const FrictionSolution& word,
                             const std::vector<int>& left_out) {
  const Eigen::Index size = problem.b.size();
  columns = Matrix::Zero(size, size);
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const Letter letter = word.letters[i];
    const bool out =
        std::find(left_out.begin(), left_out.end(), static_cast<int>(i)) != left_out.end();
    if (letter == Letter::kOpen || out) continue;
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    const bool sticks = letter == Letter::kStick;
    if (!sticks) {
      columns.block(row + 1, static_cast<Eigen::Index>(rows.size()), contact.dimension, 1) =
          -contact.coefficient * word.directions[i].head(contact.dimension);
    }
    for (int k = 0; k <= (sticks ? contact.dimension : 0); ++k) {
      columns(row + k, static_cast<Eigen::Index>(rows.size())) = 1;
      rows.push_back(row + k);
    }
  }
  columns.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(rows.size()));
}

bool SolveSlipEquations(const FrictionProblem& problem, const std::vector<int>& unknown,
                        FrictionSolution* solution) {
  if (!SolveWord(problem, solution)) return false;
  SlipEquations equations(problem, unknown, *solution);
  FrictionSolution best = *solution;
  Matrix jacobian;
  Vector residual = equations.Residual(best, &jacobian);
  for (int k = 0; k < kPolishSteps && residual.allFinite(); ++k) {
    // Angles in units of what they do, and angles of less than a turn.
    Vector unit = Vector::Ones(residual.size());
    const auto angles = static_cast<Eigen::Index>(unknown.size());
    for (Eigen::Index j = residual.size() - angles; j < residual.size(); ++j) {
      const double effect = jacobian.col(j).norm();
      if (effect > 0) unit(j) = 1 / effect;
    }
    const Matrix scaled = jacobian * unit.asDiagonal();
    const Vector step = -unit.cwiseProduct(scaled.partialPivLu().solve(residual));
    if (!step.allFinite()) break;
    FrictionSolution moved = equations.Moved(best, step);
    const Vector left = equations.Residual(moved, &jacobian);
    if (!(left.norm() < residual.norm())) break;
    best = std::move(moved);
    residual = left;
  }
  if (!(residual.norm() <= equations.Rounding(best)) || !equations.IsKnown(best)) return false;
  solution->directions = best.directions;
  return SolveWord(problem, solution);
}

}  // namespace contact_flow
