// SPDX-License-Identifier: BSD-3-Clause
#include "collocation_rule.h"

#include <boost/math/special_functions/factorials.hpp>
#include <boost/math/special_functions/legendre.hpp>
#include <cmath>
#include <vector>

#include "contact_flow/flow/radau_rule.h"

namespace contact_flow {
namespace {

/// Coefficients of a polynomial, lowest degree first.
using Polynomial = std::vector<long double>;

long double Evaluate(const Polynomial& p, long double x) {
  long double value = 0;
  for (std::size_t k = p.size(); k-- > 0;) value = value * x + p[k];
  return value;
}

/// ∫₀ˣ p.
long double Integral(const Polynomial& p, long double x) {
  long double value = 0;
  for (std::size_t k = p.size(); k-- > 0;) value = value * x + p[k] / (k + 1);
  return value * x;
}

/// The zeros of the Legendre polynomial of degree s, moved to [0, 1].
std::vector<long double> LegendreNodes(int s) {
  std::vector<long double> nodes;
  for (long double zero : boost::math::legendre_p_zeros<long double>(s)) {
    nodes.push_back((1 + zero) / 2);
    if (zero != 0) nodes.insert(nodes.begin(), (1 - zero) / 2);
  }
  return nodes;
}

/// ℓ_j(x) = ∏_{k≠j} (x − c_k)/(c_j − c_k).
Polynomial Basis(const std::vector<long double>& nodes, std::size_t j) {
  Polynomial basis = {1};
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    if (k == j) continue;
    const long double scale = 1 / (nodes[j] - nodes[k]);
    Polynomial product(basis.size() + 1, 0);
    for (std::size_t p = 0; p < basis.size(); ++p) {
      product[p + 1] += basis[p] * scale;
      product[p] -= nodes[k] * basis[p] * scale;
    }
    basis = product;
  }
  return basis;
}

/// Where between two nodes the defect is looked at: away from the middle, which
/// symmetry may favour.
constexpr long double kBetween = 0.56L;

CollocationRule::Point MakePoint(const std::vector<long double>& nodes, long double at,
                                 const Matrix& a) {
  const int s = static_cast<int>(nodes.size());
  CollocationRule::Point point;
  point.at = static_cast<double>(at);
  point.value.resize(s);
  point.once.resize(s);
  long double weight = 1;
  for (int j = 0; j < s; ++j) {
    const Polynomial basis = Basis(nodes, j);
    point.value(j) = static_cast<double>(Evaluate(basis, at));
    point.once(j) = static_cast<double>(Integral(basis, at));
    weight *= (at - nodes[j]) / nodes[j];
  }
  point.twice = a.transpose() * point.once;
  point.weight = static_cast<double>(std::abs(weight));
  return point;
}

/// The rule with these nodes, whose R(z), its step for ẏ = λy, has a numerator of degree `lower`.
CollocationRule Make(const std::vector<long double>& nodes, int lower) {
  const int s = static_cast<int>(nodes.size());
  CollocationRule rule;
  rule.stages = s;
  rule.stiff = lower < s;
  for (Vector* v : {&rule.c, &rule.b, &rule.at_end}) v->resize(s);
  rule.a.resize(s, s);
  long double product = 1;
  for (int j = 0; j < s; ++j) {
    const Polynomial basis = Basis(nodes, j);
    rule.c(j) = static_cast<double>(nodes[j]);
    rule.b(j) = static_cast<double>(Integral(basis, 1));
    rule.at_end(j) = static_cast<double>(Evaluate(basis, 1));
    for (int i = 0; i < s; ++i) rule.a(i, j) = static_cast<double>(Integral(basis, nodes[i]));
    product *= nodes[j];
  }
  rule.twice = rule.a * rule.a;
  rule.twice_end = rule.a.transpose() * rule.b;
  rule.begin = MakePoint(nodes, 0, rule.a);
  for (int i = 0; i + 1 < s; ++i) {
    const long double at = nodes[i] + kBetween * (nodes[i + 1] - nodes[i]);
    rule.between.push_back(MakePoint(nodes, at, rule.a));
  }
  using boost::math::factorial;
  rule.power = s + lower + 1;
  rule.defect = static_cast<double>(product) / factorial<double>(s);
  rule.error = factorial<double>(s) * factorial<double>(lower) /
               (factorial<double>(s + lower) * factorial<double>(rule.power));
  return rule;
}

}  // namespace

const CollocationRule& CollocationRule::GaussLegendre(int stages) {
  static const std::vector<CollocationRule> rules = [] {
    std::vector<CollocationRule> all;
    for (int s = kMinStages; s <= kMaxStages; ++s) all.push_back(Make(LegendreNodes(s), s));
    return all;
  }();
  return rules[stages - kMinStages];
}

const CollocationRule& CollocationRule::RadauIIA(int stages) {
  static const std::vector<CollocationRule> rules = [] {
    std::vector<CollocationRule> all;
    for (int s = kMinStages; s <= kMaxStages; ++s) all.push_back(Make(RadauNodes(s), s - 1));
    return all;
  }();
  return rules[stages - kMinStages];
}

}  // namespace contact_flow
