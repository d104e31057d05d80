// SPDX-License-Identifier: BSD-3-Clause
#include "gauss_legendre.h"

#include <array>
#include <boost/math/special_functions/legendre.hpp>

namespace contact_flow {
namespace {

constexpr int S = GaussLegendre::kStages;

/// Coefficients of a polynomial, lowest degree first.
using Polynomial = std::array<long double, S>;

long double Evaluate(const Polynomial& p, long double x) {
  long double value = 0;
  for (int k = S - 1; k >= 0; --k) value = value * x + p[k];
  return value;
}

long double Integral(const Polynomial& p, long double x) {
  long double value = 0;
  for (int k = S - 1; k >= 0; --k) value = value * x + p[k] / (k + 1);
  return value * x;
}

GaussLegendre Make() {
  static_assert(S % 2 == 0, "the zeros are mirrored without a middle one");
  const std::vector<long double> positive = boost::math::legendre_p_zeros<long double>(S);
  std::array<long double, S> node;
  for (int k = 0; k < S / 2; ++k) {
    node[S / 2 + k] = (1 + positive[k]) / 2;
    node[S / 2 - 1 - k] = (1 - positive[k]) / 2;
  }
  GaussLegendre rule;
  for (int j = 0; j < S; ++j) {
    Polynomial basis{};  // ℓ_j(x) = ∏_{k≠j} (x − c_k)/(c_j − c_k)
    basis[0] = 1;
    int degree = 0;
    for (int k = 0; k < S; ++k) {
      if (k == j) continue;
      const long double scale = 1 / (node[j] - node[k]);
      ++degree;
      for (int p = degree; p >= 0; --p) {
        const long double lower = p > 0 ? basis[p - 1] : 0;
        const long double same = p < degree ? basis[p] : 0;
        basis[p] = (lower - node[k] * same) * scale;
      }
    }
    rule.c(j) = static_cast<double>(node[j]);
    rule.b(j) = static_cast<double>(Integral(basis, 1));
    rule.at_begin(j) = static_cast<double>(Evaluate(basis, 0));
    rule.at_end(j) = static_cast<double>(Evaluate(basis, 1));
    for (int i = 0; i < S; ++i) rule.a(i, j) = static_cast<double>(Integral(basis, node[i]));
  }
  rule.twice = rule.a * rule.a;
  rule.twice_end = rule.a.transpose() * rule.b;
  return rule;
}

}  // namespace

const GaussLegendre& GaussLegendre::Get() {
  static const GaussLegendre rule = Make();
  return rule;
}

}  // namespace contact_flow
