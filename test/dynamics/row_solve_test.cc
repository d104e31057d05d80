// SPDX-License-Identifier: BSD-3-Clause
// Solutions row by row against the equations that they solve.
#include "src/dynamics/row_solve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace contact_flow {
namespace {

/// M of a tree of chains of three behind one body of six, and rows A that move that body and one
/// chain each: both with the zeros of robots.
struct Robot {
  explicit Robot(int chains, int rows_each) {
    const int d = 6 + 3 * chains;
    Matrix root = Matrix::Zero(d, d);  // of M = root rootᵀ + I
    for (int j = 0; j < d; ++j) {
      for (int i = 0; i < d; ++i) {
        const bool moves = i < 6 || (j >= 6 && (i - 6) / 3 == (j - 6) / 3);
        if (moves) root(i, j) = std::sin(1 + 3 * i + 7 * j);
      }
    }
    M = root * root.transpose() + Matrix::Identity(d, d);
    A.setZero(rows_each * chains, d);
    for (int r = 0; r < A.rows(); ++r) {
      const int chain = r / rows_each;
      for (int c = 0; c < d; ++c) {
        if (c < 6 || (c - 6) / 3 == chain) A(r, c) = std::cos(1 + r * (c + 2));
      }
    }
    delassus.compute(A * M.inverse() * A.transpose());
  }
  Matrix M, A;
  Eigen::LLT<Matrix> delassus;
};

Matrix Filled(int rows, int cols, double phase) {
  Matrix B(rows, cols);
  for (int c = 0; c < cols; ++c) {
    for (int r = 0; r < rows; ++r) B(r, c) = std::sin(phase + r * (c + 1));
  }
  return B;
}

/// Fewer columns than are solved at once, as many, more; and again with another size.
TEST(RowSolver, SolvesItsEquations) {
  RowSolver solver;
  for (const int chains : {4, 1, 6}) {
    const Robot robot(chains, 3);
    const auto d = static_cast<int>(robot.M.rows()), k = static_cast<int>(robot.A.rows());
    // r₂ lies in a matrix with other rows, last first.
    std::vector<int> rows;
    for (int i = k - 1; i >= 0; --i) rows.push_back(2 * i + 1);
    for (const int columns : {1, 12, 29}) {
      const Matrix r1 = Filled(d, columns, 1), wide = Filled(2 * k + 1, columns, 2),
                   more = Filled(d, 2, 3), wide_more = Filled(2 * k + 1, 2, 4);
      Matrix X(d, columns + 2), Lambda(k, columns + 2);
      solver.Start(rows);
      solver.Add(r1, wide);
      solver.Add(more, wide_more);
      solver.Solve(robot.M, robot.A, robot.delassus, &X, &Lambda);
      Matrix all_r1(d, columns + 2), r2(k, columns + 2);
      all_r1 << r1, more;
      for (int i = 0; i < k; ++i) r2.row(i) << wide.row(rows[i]), wide_more.row(rows[i]);
      // Rounding: d + k products of numbers below these sizes.
      const double size = robot.M.norm() * X.norm() + robot.A.norm() * Lambda.norm() + r1.norm();
      const double rounding = 1e-15 * (d + k) * size;
      EXPECT_LT((robot.M * X - robot.A.transpose() * Lambda + all_r1).norm(), rounding);
      EXPECT_LT((robot.A * X + r2).norm(), rounding);
    }
  }
}

}  // namespace
}  // namespace contact_flow
