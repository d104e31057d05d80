// SPDX-License-Identifier: BSD-3-Clause
#include "half_spaces.h"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

/// A half-space whose normal shrinks to this part under a linear map is the whole space: the map
/// sends everything onto the boundary.
constexpr double kVanished = 1e-12;

}  // namespace

Hyperplanes::Hyperplanes(int dimension, double tolerance)
    : tolerance_(tolerance), probe_(dimension) {
  for (int k = 0; k < dimension; ++k) probe_(k) = std::cos(1 + std::sqrt(2.0) * k);
}

int Hyperplanes::SignedNumber(const VectorRef& normal) {
  AskBudget();
  const double reach = tolerance_ * probe_.cwiseAbs().sum();
  for (int sign : {1, -1}) {
    const double place = sign * probe_.dot(normal);
    for (auto it = sorted_.lower_bound(place - reach);
         it != sorted_.end() && it->first <= place + reach; ++it) {
      const Vector& other = normals_[static_cast<std::size_t>(it->second)];
      if ((sign * normal - other).cwiseAbs().maxCoeff() <= tolerance_) {
        return sign * (it->second + 1);
      }
    }
  }
  sorted_.emplace(probe_.dot(normal), size());
  normals_.push_back(normal);
  return size();
}

Matrix PullBack(const Matrix& rows, const Matrix& matrix) {
  Matrix pulled = rows * matrix;
  const double scale = matrix.size() > 0 ? matrix.cwiseAbs().maxCoeff() : 0;
  Eigen::Index kept = 0;
  for (Eigen::Index r = 0; r < pulled.rows(); ++r) {
    const double length = pulled.row(r).norm();
    if (length > kVanished * scale) pulled.row(kept++) = (pulled.row(r) / length).eval();
  }
  return pulled.topRows(kept);
}

Matrix Restrict(const Matrix& rows, const Matrix& basis, double tolerance) {
  Matrix kept(rows.rows(), basis.cols());
  Eigen::Index count = 0;
  for (Eigen::Index r = 0; r < rows.rows(); ++r) {
    const Eigen::RowVectorXd row = rows.row(r) * basis;
    const double length = row.norm();
    if (!(length > tolerance)) continue;
    bool known = false;
    for (Eigen::Index k = 0; k < count && !known; ++k) {
      known = (kept.row(k) - row / length).cwiseAbs().maxCoeff() <= 1e-3 * tolerance;
    }
    if (!known) kept.row(count++) = row / length;
  }
  return kept.topRows(count);
}

Matrix Stack(const Matrix& above, const Matrix& below) {
  Matrix both(above.rows() + below.rows(), above.cols());
  both << above, below;
  return both;
}

Matrix BasisOf(const Matrix& normal) {
  const Eigen::Index n = normal.cols();
  const Eigen::HouseholderQR<Matrix> factor(normal.transpose());
  return Matrix(factor.householderQ()).rightCols(n - 1);
}

double SmallestHeight(const Matrix& rows, const Vector& w) {
  return rows.rows() == 0 ? std::numeric_limits<double>::infinity() : (rows * w).minCoeff();
}

}  // namespace contact_flow
