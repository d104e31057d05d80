// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/radau_rule.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

namespace contact_flow {
namespace {

// All in long double: the coefficients are right to the last digit of a double.
using Real = long double;
using RealVector = Eigen::Matrix<Real, Eigen::Dynamic, 1>;
using RealMatrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
using ComplexMatrix = Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic>;

/// P_s − P_{s−1} at 2θ − 1.
Real RadauPolynomial(int s, Real theta) {
  const Real x = 2 * theta - 1;
  Real before = 1, now = x;  // P₀, P₁
  for (int k = 1; k < s; ++k) {
    const Real next = ((2 * k + 1) * x * now - k * before) / (k + 1);
    before = now;
    now = next;
  }
  return now - before;
}

RealVector Monomials(int count, Real theta) {
  RealVector values(count);
  values(0) = 1;
  for (int k = 1; k < count; ++k) values(k) = values(k - 1) * theta;
  return values;
}

RealVector Slopes(int count, Real theta) {
  RealVector slopes = RealVector::Zero(count);
  Real power = 1;
  for (int k = 1; k < count; ++k, power *= theta) slopes(k) = k * power;
  return slopes;
}

/// Coefficients of ∏(θ − c_i) [s+1].
RealVector NodePolynomial(const RealVector& c) {
  RealVector product = RealVector::Zero(c.size() + 1);
  product(0) = 1;
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    for (Eigen::Index k = i + 1; k > 0; --k) product(k) = product(k - 1) - c(i) * product(k);
    product(0) *= -c(i);
  }
  return product;
}

/// The polynomials by which Z and ρ enter u*, a column each [s+2 × s+1].
RealMatrix Extension(const RealVector& c) {
  const auto s = static_cast<int>(c.size());
  RealMatrix at_nodes(s + 1, s + 1);
  at_nodes.row(0) = Monomials(s + 1, 0).transpose();
  for (int i = 0; i < s; ++i) at_nodes.row(i + 1) = Monomials(s + 1, c(i)).transpose();
  RealMatrix columns = RealMatrix::Zero(s + 2, s + 1);
  columns.topLeftCorner(s + 1, s) = at_nodes.fullPivLu().inverse().rightCols(s);
  const RealVector product = NodePolynomial(c);
  for (int k = 0; k <= s; ++k) columns(k + 1, s) = -product(k) / ((k + 1) * product(0));
  return columns;
}

/// Of u* to the coefficients c₂ … c₇ of EvaluateDenseStep: these vanish at both ends.
RealMatrix DenseCoefficients(const RealMatrix& extension) {
  constexpr int kBubbles = 6;
  const auto size = static_cast<int>(extension.rows());
  RealMatrix basis(kBubbles, kBubbles), values(kBubbles, extension.cols());
  const RealMatrix at_end = Monomials(size, 1).transpose() * extension;
  for (int k = 0; k < kBubbles; ++k) {
    const Real theta = Real(k + 1) / (kBubbles + 1), rest = 1 - theta;
    Real term = theta * rest;
    for (int j = 0; j < kBubbles; ++j) {
      basis(k, j) = term;
      term *= j % 2 == 0 ? theta : rest;
    }
    values.row(k) = Monomials(size, theta).transpose() * extension - theta * at_end;
  }
  return basis.fullPivLu().solve(values);
}

void Diagonalize(const RealMatrix& inverse, RadauRule* rule) {
  const Eigen::EigenSolver<RealMatrix> eigen(inverse);
  const ComplexMatrix T = eigen.eigenvectors(), back = T.fullPivLu().inverse();
  for (int k = 0; k < rule->stages; ++k) {
    const std::complex<Real> value = eigen.eigenvalues()(k);
    if (value.imag() < 0) continue;
    if (value.imag() == 0) {  // scaled so that its vectors are real
      const std::complex<Real> unit = T(rule->stages - 1, k);
      rule->real_eigenvalue = static_cast<double>(value.real());
      rule->from_real = (T.col(k) / unit).real().cast<double>();
      rule->to_real = (back.row(k) * unit).real().transpose().cast<double>();
    } else {
      rule->eigenvalues.emplace_back(value);
      rule->from_pair.push_back((Real(2) * T.col(k)).cast<std::complex<double>>());
      rule->to_pair.push_back(back.row(k).transpose().cast<std::complex<double>>());
    }
  }
}

RadauRule Make(int s, const std::array<double, 2>& check) {
  RadauRule rule;
  rule.stages = s;
  const std::vector<Real> nodes = RadauNodes(s);
  const RealVector c = Eigen::Map<const RealVector>(nodes.data(), s);
  rule.c = c.cast<double>();
  const RealMatrix extension = Extension(c);
  RealMatrix inverse(s, s);
  for (int i = 0; i < s; ++i) {
    inverse.row(i) = Slopes(s + 2, c(i)).transpose() * extension.leftCols(s);
  }
  rule.inverse = inverse.cast<double>();
  rule.a = inverse.fullPivLu().inverse().cast<double>();
  Diagonalize(inverse, &rule);
  rule.slope_at_begin = (Slopes(s + 2, 0).transpose() * extension).head(s).cast<double>();
  rule.check = check;
  for (std::size_t k = 0; k < check.size(); ++k) {
    rule.value_at_check[k] =
        (Monomials(s + 2, check[k]).transpose() * extension).transpose().cast<double>();
    rule.slope_at_check[k] =
        (Slopes(s + 2, check[k]).transpose() * extension).transpose().cast<double>();
  }
  rule.dense = DenseCoefficients(extension).cast<double>();
  return rule;
}

}  // namespace

std::vector<long double> RadauNodes(int s) {
  constexpr int kScan = 1000, kHalvings = 70;
  std::vector<Real> nodes;
  for (int k = 0; k + 1 < kScan; ++k) {
    Real left = Real(k) / kScan, right = Real(k + 1) / kScan;
    const bool negative = RadauPolynomial(s, left) < 0;
    if (negative == (RadauPolynomial(s, right) < 0)) continue;
    for (int half = 0; half < kHalvings; ++half) {
      const Real middle = (left + right) / 2;
      (RadauPolynomial(s, middle) < 0) == negative ? left = middle : right = middle;
    }
    nodes.push_back((left + right) / 2);
  }
  nodes.push_back(1);
  return nodes;
}

const RadauRule& RadauRule::WithStages(int s) {
  // Between the nodes, where guards are looked at, too: see StagePlaces.
  static const RadauRule three = Make(3, {0.39, 0.84}), five = Make(5, {0.43, 0.72});
  return s == 3 ? three : five;
}

}  // namespace contact_flow
