// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/height_grid.h"

#include <stdexcept>
#include <string>

namespace contact_flow {
namespace {

/// Weights c of B-splines with (c_{k−1} + 4 c_k + c_{k+1})/6 = f_k for each column of f, and second
/// derivative zero at both ends: c_0 = f_0 and c_{−1} = 2 c_0 − c_1 there. Elimination of a
/// tridiagonal matrix whose diagonal dominates.
Matrix Interpolate(const Matrix& f) {
  const Eigen::Index n = f.rows();
  Matrix c(n + 2, f.cols());
  c.middleRows(1, n) = f;
  Vector upper = Vector::Zero(n);
  for (Eigen::Index k = 1; k + 1 < n; ++k) {
    const double pivot = 4 - upper(k - 1);
    upper(k) = 1 / pivot;
    c.row(k + 1) = ((6 * f.row(k) - c.row(k)) / pivot).eval();
  }
  for (Eigen::Index k = n - 2; k > 0; --k) c.row(k + 1) -= upper(k) * c.row(k + 2);
  c.row(0) = 2 * c.row(1) - c.row(2);
  c.row(n + 1) = 2 * c.row(n) - c.row(n - 1);
  return c;
}

}  // namespace

HeightGrid::HeightGrid(const Frame& frame, const Matrix& heights) : frame_(frame) {
  if (heights.rows() < 2 || heights.cols() < 2) {
    throw std::invalid_argument(std::to_string(heights.rows()) + " × " +
                                std::to_string(heights.cols()) +
                                " heights, expected two each way at least");
  }
  if (!(frame.dx > 0) || !(frame.dy > 0)) {
    throw std::invalid_argument("the steps of the grid are not positive");
  }
  if (!heights.allFinite()) throw std::invalid_argument("a height is not finite");
  weight_ = Interpolate(Interpolate(heights).transpose()).transpose();
}

}  // namespace contact_flow
