// SPDX-License-Identifier: BSD-3-Clause
#include "dependent_rows.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "cone_program.h"
#include "contact_flow/dynamics/complementarity.h"

namespace contact_flow {
namespace {

/// The margin is looked for up to this many times the force.
constexpr double kFar = 10;
/// Entries of forces that do not push which are rounding, relative.
constexpr double kNoPart = 1e-8;
/// A margin below this part of the force leaves no room.
constexpr double kNoRoom = 1e-9;
/// The first row is taken of those with this part of what is left of any: rounding of rows that are
/// alike does not decide which of them are.
constexpr double kAlmostMost = 0.5;
/// Rows are dependent below this eigenvalue of their normalized Gram matrix.
constexpr double kDependentForce = 1e-11;

bool IsRound(const ForceCone& cone) {
  return cone.dimension > 0 && std::isfinite(cone.coefficient);
}

/// s = c + B ν of all cones, without their margins.
struct Rows {
  Vector c;
  Matrix B;
  std::vector<int> sizes;
};

Rows ConeRows(const std::vector<ForceCone>& cones, const Vector& force, const Matrix& freedom) {
  Rows rows;
  int count = 0;
  for (const ForceCone& cone : cones) {
    rows.sizes.push_back(IsRound(cone) ? 1 + cone.dimension : 1);
    count += rows.sizes.back();
  }
  rows.c.resize(count);
  rows.B.resize(count, freedom.cols());
  int row = 0;
  for (const ForceCone& cone : cones) {
    const double factor = IsRound(cone) ? cone.coefficient : 1;
    rows.c(row) = factor * force(cone.normal);
    rows.B.row(row++) = factor * freedom.row(cone.normal);
    for (int k = 0; IsRound(cone) && k < cone.dimension; ++k) {
      rows.c(row) = force(cone.tangential + k);
      rows.B.row(row++) = freedom.row(cone.tangential + k);
    }
  }
  return rows;
}

double ConeSlack(const ForceCone& cone, const Vector& force) {
  if (!IsRound(cone)) return force(cone.normal);
  return cone.coefficient * force(cone.normal) -
         force.segment(cone.tangential, cone.dimension).norm();
}

}  // namespace

Matrix RowBasis::PseudoInverse() const {
  const Eigen::LLT<Matrix> squares(freedom.transpose() * freedom);
  const auto shortened = [&](const Matrix& columns) {
    return Matrix(columns - freedom * squares.solve(freedom.transpose() * columns));
  };
  const Matrix half = shortened(inverse);
  return shortened(half.transpose());
}

bool HasDependentRows(const Matrix& G) {
  if (G.size() == 0) return false;
  const Vector unit = G.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Matrix> values(unit.asDiagonal() * G * unit.asDiagonal());
  return values.eigenvalues().minCoeff() < kDependentForce;
}

RowBasis FindRowBasis(const Matrix& G) {
  const auto k = static_cast<int>(G.rows());
  const Vector unit = G.diagonal().cwiseSqrt().cwiseInverse();
  Matrix left = unit.asDiagonal() * G * unit.asDiagonal();
  std::vector<bool> chosen(static_cast<std::size_t>(k), false);
  for (int count = 0; count < k; ++count) {
    double most = 0;
    for (int i = 0; i < k; ++i) {
      if (!chosen[static_cast<std::size_t>(i)]) most = std::max(most, left(i, i));
    }
    if (!(most > kDependentRow)) break;
    int next = 0;  // never a row of zeros, of which nothing is a number
    while (chosen[static_cast<std::size_t>(next)] || !(left(next, next) >= kAlmostMost * most)) {
      ++next;
    }
    chosen[static_cast<std::size_t>(next)] = true;
    const Vector column = left.col(next) / std::sqrt(left(next, next));
    left -= column * column.transpose();
  }
  RowBasis basis;
  std::vector<int> others;
  for (int i = 0; i < k; ++i) {
    (chosen[static_cast<std::size_t>(i)] ? basis.rows : others).push_back(i);
  }
  const auto r = static_cast<Eigen::Index>(basis.rows.size());
  const auto f = static_cast<Eigen::Index>(others.size());
  Matrix block(r, r), across(r, f);
  for (Eigen::Index i = 0; i < r; ++i) {
    const int row = basis.rows[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < r; ++j) {
      const int column = basis.rows[static_cast<std::size_t>(j)];
      block(i, j) = unit(row) * G(row, column) * unit(column);
    }
    for (Eigen::Index j = 0; j < f; ++j) {
      across(i, j) = unit(row) * G(row, others[static_cast<std::size_t>(j)]);
    }
  }
  const Eigen::LLT<Matrix> factor(block);
  const Matrix inverse = factor.solve(Matrix::Identity(r, r));
  Matrix combination = across;
  if (f > 0) factor.solveInPlace(combination);
  for (Eigen::Index j = 0; j < f; ++j) {
    const double own = 1 / unit(others[static_cast<std::size_t>(j)]);
    const double rounding = kNoPart * std::max(own, combination.col(j).cwiseAbs().maxCoeff());
    const auto part = combination.col(j);
    combination.col(j) = (part.array().abs() > rounding).select(part, 0).eval();
  }
  basis.inverse = Matrix::Zero(k, k);
  basis.freedom = Matrix::Zero(k, f);
  for (Eigen::Index i = 0; i < r; ++i) {
    const int row = basis.rows[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < r; ++j) {
      const int column = basis.rows[static_cast<std::size_t>(j)];
      basis.inverse(row, column) = unit(row) * inverse(i, j) * unit(column);
    }
    basis.freedom.row(row) = -unit(row) * combination.row(i);
  }
  for (Eigen::Index j = 0; j < f; ++j) basis.freedom(others[static_cast<std::size_t>(j)], j) = 1;
  return basis;
}

Matrix WithoutRounding(const Matrix& freedom) {
  Matrix clean = freedom;
  for (Eigen::Index j = 0; j < clean.cols(); ++j) {
    const double rounding = kNoPart * clean.col(j).cwiseAbs().maxCoeff();
    clean.col(j) = (clean.col(j).array().abs() > rounding).select(clean.col(j), 0);
  }
  return clean;
}

double LeastSlack(const std::vector<ForceCone>& cones, const Vector& force) {
  double least = std::numeric_limits<double>::infinity();
  for (const ForceCone& cone : cones) least = std::min(least, ConeSlack(cone, force));
  return least;
}

namespace {

/// Where no share changes a cone: the tightest one.
ForceShare OnlyShare(const std::vector<ForceCone>& cones, const Vector& force) {
  ForceShare share;
  share.margin = std::numeric_limits<double>::infinity();
  share.force = force;
  const ForceCone* tightest = nullptr;
  for (const ForceCone& cone : cones) {
    const double margin = ConeSlack(cone, force) / cone.weight;
    if (!(margin < share.margin)) continue;
    share.margin = margin;
    tightest = &cone;
  }
  share.gradient = Vector::Zero(force.size());
  if (tightest == nullptr) return share;
  share.gradient(tightest->normal) = (IsRound(*tightest) ? tightest->coefficient : 1);
  if (IsRound(*tightest)) {
    const auto tangential = force.segment(tightest->tangential, tightest->dimension);
    if (tangential.norm() > 0) {
      share.gradient.segment(tightest->tangential, tightest->dimension) = -tangential.normalized();
    }
  }
  share.gradient /= tightest->weight;
  return share;
}

/// A basis of the shares that change a cone: contacts without slip leave others free.
Matrix Effective(const Matrix& freedom, const Rows& rows) {
  Eigen::ColPivHouseholderQR<Matrix> factor(rows.B.transpose());
  factor.setThreshold(kNoPart);
  const Matrix Q = factor.householderQ() * Matrix::Identity(freedom.cols(), factor.rank());
  return freedom * Q;
}

}  // namespace

ForceShare MostInterior(const std::vector<ForceCone>& cones, const Vector& force,
                        const Matrix& all_freedom) {
  ForceShare share;
  share.force = force;
  share.gradient = Vector::Zero(force.size());
  const double size = force.cwiseAbs().maxCoeff();
  if (!(size > 0) || !std::isfinite(size) || cones.empty()) return share;
  double heaviest = 0;
  for (const ForceCone& cone : cones) heaviest = std::max(heaviest, cone.weight);
  const Matrix freedom = Effective(all_freedom, ConeRows(cones, force / size, all_freedom));
  if (freedom.cols() == 0) return OnlyShare(cones, force);
  const Rows rows = ConeRows(cones, force / size, freedom);
  const Eigen::Index m = rows.c.size(), f = freedom.cols();
  // The margin is the last unknown, with a row that bounds it.
  Matrix B = Matrix::Zero(m + 1, f + 1);
  Vector c(m + 1), objective = Vector::Zero(f + 1), start = Vector::Zero(f + 1);
  B.topLeftCorner(m, f) = rows.B;
  c << rows.c, kFar;
  B(m, f) = objective(f) = -1;
  std::vector<int> sizes = rows.sizes;
  sizes.push_back(1);
  double least = kFar;
  int row = 0;
  for (std::size_t k = 0; k < cones.size(); row += rows.sizes[k++]) {
    B(row, f) = -cones[k].weight / heaviest;
    least = std::min(least, ConeSlack(cones[k], force / size) * heaviest / cones[k].weight);
  }
  start(f) = least - 1;
  const std::optional<ConeSolution> found = SolveConeProgram(objective, c, B, sizes, start);
  if (!found) {
    share.margin = std::numeric_limits<double>::quiet_NaN();
    return share;
  }
  share.force = force + size * (freedom * found->z.head(f));
  share.margin = size * c.dot(found->dual) / heaviest;
  row = 0;
  for (std::size_t k = 0; k < cones.size(); row += rows.sizes[k++]) {
    const ForceCone& cone = cones[k];
    const double factor = IsRound(cone) ? cone.coefficient : 1;
    share.gradient(cone.normal) += factor * found->dual(row) / heaviest;
    for (int j = 1; j < rows.sizes[k]; ++j) {
      share.gradient(cone.tangential + j - 1) += found->dual(row + j) / heaviest;
    }
  }
  return share;
}

Vector SmallestShare(const std::vector<ForceCone>& cones, const Vector& force,
                     const Matrix& freedom, const ForceShare& interior) {
  const double size = force.cwiseAbs().maxCoeff();
  if (LeastSlack(cones, force) >= 0) return force;
  if (!(interior.margin > kNoRoom * size)) return interior.force;
  // min r, (r, λ) in a cone of its own; λ = force + Z ν, in units of `size`.
  const Rows rows = ConeRows(cones, force / size, freedom);
  const Eigen::Index m = rows.c.size(), f = freedom.cols(), k = force.size();
  Matrix B = Matrix::Zero(m + 1 + k, f + 1);
  Vector c(m + 1 + k), objective = Vector::Zero(f + 1), start(f + 1);
  B.topLeftCorner(m, f) = rows.B;
  B(m, f) = objective(f) = 1;
  B.bottomLeftCorner(k, f) = freedom;
  c << rows.c, 0, force / size;
  std::vector<int> sizes = rows.sizes;
  sizes.push_back(1 + static_cast<int>(k));
  start << freedom.colPivHouseholderQr().solve(interior.force - force) / size,
      1 + 2 * interior.force.norm() / size;
  const std::optional<ConeSolution> found = SolveConeProgram(objective, c, B, sizes, start);
  if (!found) return interior.force;
  return force + size * (freedom * found->z.head(f));
}

}  // namespace contact_flow
