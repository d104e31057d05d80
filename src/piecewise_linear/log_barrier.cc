// SPDX-License-Identifier: BSD-3-Clause
#include "log_barrier.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// What is larger is multiplied and factored by blocks of as many columns: a budget
/// is asked between.
constexpr Eigen::Index kBlock = 128;

/// H += DᵀD; where that takes long the part below the diagonal alone.
void AddSquare(const Matrix& D, Matrix* H) {
  const Eigen::Index n = H->cols();
  if (n <= kBlock) {
    H->noalias() += D.transpose() * D;
    return;
  }
  for (Eigen::Index c = 0; c < n; c += kBlock) {
    AskBudget();
    const Eigen::Index width = std::min(kBlock, n - c);
    H->block(c, c, n - c, width).noalias() +=
        D.rightCols(n - c).transpose() * D.middleCols(c, width);
  }
}

/// H⁻¹b by Cholesky's method, H positive definite, its part below the diagonal given and replaced
/// by the factor; not finite where H is not positive definite.
Vector SolveByBlocks(Matrix* H, const Vector& b) {
  Matrix& L = *H;
  const Eigen::Index n = L.cols();
  for (Eigen::Index c = 0; c < n; c += kBlock) {
    const Eigen::Index width = std::min(kBlock, n - c), rest = n - c - width;
    const Eigen::LLT<Matrix> corner(Matrix(L.block(c, c, width, width)));
    if (corner.info() != Eigen::Success) return Vector::Constant(n, std::nan(""));
    L.block(c, c, width, width) = corner.matrixL();
    if (rest == 0) break;
    auto below = L.block(c + width, c, rest, width);
    corner.matrixU().solveInPlace<Eigen::OnTheRight>(below);
    for (Eigen::Index k = 0; k < rest; k += kBlock) {
      AskBudget();
      const Eigen::Index part = std::min(kBlock, rest - k);
      L.block(c + width + k, c + width + k, rest - k, part).noalias() -=
          below.bottomRows(rest - k) * below.middleRows(k, part).transpose();
    }
  }
  const Vector half = L.triangularView<Eigen::Lower>().solve(b);
  return L.transpose().triangularView<Eigen::Upper>().solve(half);
}

}  // namespace

LogBarrier::LogBarrier(Eigen::Index unknowns, int largest_matrix, const std::string& purpose) {
  const double size = largest_matrix, count = static_cast<double>(unknowns);
  AskMemory(8.0 * count * (size * size + 2.0 * count), purpose);
  gradient_ = Vector::Zero(unknowns);
  hessian_ = Matrix::Zero(unknowns, unknowns);
}

void LogBarrier::Add(const Matrix& directions) {
  const auto size = static_cast<Eigen::Index>(std::lround(std::sqrt(directions.rows())));
  for (Eigen::Index i = 0; i < size; ++i) {
    gradient_ -= directions.row(i * size + i).transpose();
  }
  AddSquare(directions, &hessian_);
}

void LogBarrier::AddSquares(const VectorRef& y, Eigen::Index first, Eigen::Index count,
                            double epsilon) {
  gradient_.segment(first, count) += epsilon * y.segment(first, count);
  hessian_.diagonal().segment(first, count).array() += epsilon;
}

double LogBarrier::Step(Vector* step) {
  constexpr double kWhole = 0.25;  // decrement below which the step is not damped
  constexpr double kRounding = 1e-13;
  // With a diagonal of ones, and a little more against rounding: unknowns may differ in size.
  const Vector scale = hessian_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  hessian_ = (scale.asDiagonal() * hessian_ * scale.asDiagonal()).eval();
  hessian_.diagonal().array() += kRounding;
  const Vector scaled = scale.asDiagonal() * gradient_;
  *step = gradient_.size() <= kBlock ? Vector(-hessian_.ldlt().solve(scaled))
                                     : Vector(-SolveByBlocks(&hessian_, scaled));
  *step = (scale.asDiagonal() * *step).eval();
  const double square = -gradient_.dot(*step);
  if (!(square >= 0) || !step->allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const double decrement = std::sqrt(square);
  if (decrement >= kWhole) *step /= 1 + decrement;
  return decrement;
}

}  // namespace contact_flow
