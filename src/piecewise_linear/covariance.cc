// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/piecewise_linear/covariance.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>

#include "contact_flow/budget.h"

namespace contact_flow {
namespace {

constexpr double kSameMatrix = 1e-12;    // rows that differ less, relative, are one …
constexpr double kSameRounding = 1e-15;  // … and so are those that do by rounding of the largest
constexpr double kOppositeNormals = 1e-12;  // normals that add up to less are opposite
constexpr double kAgree =
    1e-7;  // jump between pieces, relative, that is an error of the derivative
constexpr double kNegative =
    1e-10;  // an eigenvalue of P this far below zero, relative, is a rounding error
constexpr double kSymmetric = 1e-9;          // of entries that mirror each other, relative
constexpr double kVarianceRounding = 1e-15;  // of all entries beside the largest
constexpr double kDependent =
    1e-13;  // a variance of which the others leave less than this part is theirs
const double kPi = std::acos(-1.0);

/// Throws std::invalid_argument unless P is symmetric and has no negative eigenvalue, both beside
/// the variances of its rows, so that units do not matter, and beside rounding of the largest.
void RequireCovariance(const MatrixRef& P) {
  const double rounding = kVarianceRounding * P.cwiseAbs().maxCoeff();
  const Vector sizes = (P.diagonal().cwiseMax(0).array() + rounding).sqrt();
  const Matrix limits = kSymmetric * sizes * sizes.transpose();
  const Matrix difference = (P - P.transpose()).cwiseAbs();
  if (!P.allFinite() || (difference.array() > limits.array() + rounding).any()) {
    throw std::invalid_argument("the covariance is not finite and symmetric");
  }
  if (P.isZero(0)) return;
  Matrix scaled = P;
  scaled.diagonal().array() += rounding;
  scaled.array() /= (sizes * sizes.transpose()).array();
  const Eigen::SelfAdjointEigenSolver<Matrix> spectrum(scaled, Eigen::EigenvaluesOnly);
  if (spectrum.eigenvalues()(0) >= -kNegative) return;
  const Eigen::SelfAdjointEigenSolver<Matrix> plain(P, Eigen::EigenvaluesOnly);
  std::ostringstream message;
  message << "the covariance has the negative eigenvalue " << plain.eigenvalues()(0)
          << "; beside the standard deviations of its rows " << spectrum.eigenvalues()(0);
  throw std::invalid_argument(message.str());
}

/// R [n×k] with R Rᵀ = P, k the rank of P: by Cholesky's method, whose pivots are judged beside the
/// variances that they are of, so that units do not matter.
Matrix CovarianceRoot(const MatrixRef& P, int n) {
  if (P.rows() != n || P.cols() != n) {
    throw std::invalid_argument("the covariance needs " + std::to_string(n) + " rows and columns");
  }
  RequireCovariance(P);
  Matrix rest = 0.5 * (P + P.transpose()), root(n, n);
  const Vector variances = rest.diagonal();
  Eigen::Index k = 0;
  for (; k < n; ++k) {
    Eigen::Index pivot = -1;
    double largest = kDependent;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (!(variances(i) > 0) || !(rest(i, i) > largest * variances(i))) continue;
      pivot = i;
      largest = rest(i, i) / variances(i);
    }
    if (pivot < 0) break;
    root.col(k) = rest.col(pivot) / std::sqrt(rest(pivot, pivot));
    rest -= root.col(k) * root.col(k).transpose();
    rest.row(pivot).setZero();
    rest.col(pivot).setZero();
  }
  return root.leftCols(k);
}

/// Whether all pieces are one, each row by itself: a small one has small kinks.
bool IsLinear(const PiecewiseLinearMap& map) {
  const Matrix& first = map.pieces().front().matrix;
  Vector sizes = Vector::Zero(map.rows()), kinks = sizes;
  for (const LinearPiece& piece : map.pieces()) {
    sizes = sizes.cwiseMax(piece.matrix.cwiseAbs().rowwise().maxCoeff());
    kinks = kinks.cwiseMax((piece.matrix - first).cwiseAbs().rowwise().maxCoeff());
  }
  const double rounding = kSameRounding * sizes.maxCoeff();
  return (kinks.array() <= (kSameMatrix * sizes).array().max(rounding)).all();
}

bool IsHalfSpaces(const PiecewiseLinearMap& map) {
  if (map.pieces().size() != 2) return false;
  const Matrix &a = map.pieces()[0].cone, &b = map.pieces()[1].cone;
  if (a.rows() != 1 || b.rows() != 1 || (a + b).norm() > kOppositeNormals) return false;
  // The pieces must agree on the face: their difference is k nᵀ.
  const Matrix difference = map.pieces()[0].matrix - map.pieces()[1].matrix;
  const double size = map.pieces()[0].matrix.norm() + map.pieces()[1].matrix.norm();
  return (difference - (difference * a.transpose()) * a).norm() <= kAgree * size;
}

void Truncate(const PiecewiseLinearMap& map, const MatrixRef& P, OutcomeCovariance* result) {
  const LinearPiece &above = map.pieces()[0], &below = map.pieces()[1];
  const Vector n = above.cone.row(0).transpose();
  const Matrix& A = below.matrix;
  const Vector k = (above.matrix - below.matrix) * n;  // above − below = k nᵀ
  const double variance = std::max(0.0, n.dot(P * n));
  const Vector cross = A * (P * n);
  result->method = CovarianceMethod::kTruncation;
  result->mean = k * std::sqrt(variance / (2 * kPi));
  result->covariance = A * P * A.transpose() +
                       0.5 * (cross * k.transpose() + k * cross.transpose()) +
                       k * k.transpose() * (variance * (0.5 - 0.5 / kPi));
}

/// A random rotation of ℝᵏ; in the plane, the `index`-th of `count` even ones.
Matrix Rotation(Eigen::Index k, int index, int count, std::mt19937* generator) {
  if (k == 1) return Matrix::Identity(1, 1);
  Matrix Q(k, k);
  if (k == 2) {
    const double angle = kPi / 2 * (index + 0.5) / count;
    Q << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
    return Q;
  }
  std::normal_distribution<double> normal;
  for (Eigen::Index i = 0; i < Q.size(); ++i) Q(i) = normal(*generator);
  return Eigen::HouseholderQR<Matrix>(Q).householderQ();
}

void Cubature(const PiecewiseLinearMap& map, const Matrix& root, const CovarianceOptions& options,
              OutcomeCovariance* result) {
  const Eigen::Index k = root.cols(), r = map.rows();
  const int count = k == 1 ? 1 : std::max(2, options.rotations);
  // E ρ and E ρ² of the χ distribution with k degrees of freedom; E ρ² = k.
  const double second = static_cast<double>(k);
  const double first =
      std::sqrt(2.0) * std::exp(std::lgamma(0.5 * (second + 1)) - std::lgamma(0.5 * second));
  const BudgetStage stage("the cubature");
  std::mt19937 generator(options.seed);
  Vector mean = Vector::Zero(r), mean_square = Vector::Zero(r);
  Matrix moment = Matrix::Zero(r, r), moment_square = Matrix::Zero(r, r);
  for (int index = 0; index < count; ++index) {
    AskBudget();
    const Matrix directions = root * Rotation(k, index, count, &generator);
    Vector one_mean = Vector::Zero(r);
    Matrix one_moment = Matrix::Zero(r, r);
    for (Eigen::Index i = 0; i < k; ++i) {
      for (double sign : {1.0, -1.0}) {
        AskBudget();
        const Vector value = map(sign * directions.col(i));
        one_mean += first / (2 * second) * value;
        one_moment += 0.5 * value * value.transpose();
        ++result->points;
      }
    }
    mean += one_mean / count;
    moment += one_moment / count;
    mean_square += one_mean.cwiseAbs2() / count;
    moment_square += one_moment.cwiseAbs2() / count;
  }
  const auto error = [count](double sum) { return std::sqrt(std::max(0.0, sum) / count); };
  result->method = CovarianceMethod::kCubature;
  result->mean = mean;
  result->covariance = moment - mean * mean.transpose();
  result->mean_error = error((mean_square - mean.cwiseAbs2()).maxCoeff());
  result->covariance_error = error((moment_square - moment.cwiseAbs2()).maxCoeff()) +
                             2 * mean.cwiseAbs().maxCoeff() * result->mean_error;
}

}  // namespace

const char* CovarianceMethodName(CovarianceMethod method) {
  constexpr const char* kNames[] = {"linear", "truncation", "cubature"};
  return kNames[static_cast<int>(method)];
}

OutcomeCovariance PropagateCovariance(const PiecewiseLinearMap& map, const MatrixRef& P,
                                      const CovarianceOptions& options) {
  if (options.rotations < 1) {
    throw std::invalid_argument("rotations is " + std::to_string(options.rotations) +
                                ", expected ≥ 1");
  }
  RequireEntries(map);
  const Matrix root = CovarianceRoot(P, map.cols());
  OutcomeCovariance result;
  const Matrix& A = map.pieces().front().matrix;
  if (IsLinear(map) || root.cols() == 0) {
    result.mean = Vector::Zero(map.rows());
    result.covariance = A * P * A.transpose();
  } else if (IsHalfSpaces(map)) {
    Truncate(map, P, &result);
  } else {
    Cubature(map, root, options, &result);
  }
  return result;
}

}  // namespace contact_flow
