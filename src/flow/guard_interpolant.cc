// SPDX-License-Identifier: BSD-3-Clause
#include "guard_interpolant.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace contact_flow {
namespace {

/// What of a change is rounding, relative to the guard.
constexpr double kChangeRounding = 1e-13;

/// Whether Bernstein coefficients fall and rise again: a polynomial turns no more often than they.
bool Dips(const std::array<double, 6>& coefficients) {
  const double noise = kChangeRounding * std::abs(coefficients[0]);
  bool fell = false;
  for (std::size_t k = 1; k < coefficients.size(); ++k) {
    const double change = coefficients[k] - coefficients[k - 1];
    if (fell && change > noise) return true;
    fell = fell || change < -noise;
  }
  return false;
}

}  // namespace

GuardBound QuinticBound(double h, const GuardJet& begin, const GuardJet& end) {
  const double g0 = begin.value, g1 = end.value, d0 = h * begin.rate, d1 = h * end.rate;
  const double c0 = h * h * begin.acceleration, c1 = h * h * end.acceleration;
  const double cubic0 = 6 * (g1 - g0) - 4 * d0 - 2 * d1;
  const double cubic1 = -6 * (g1 - g0) + 2 * d0 + 4 * d1;
  const std::array<double, 6> b = {
      g0, g0 + d0 / 5, g0 + 2 * d0 / 5 + c0 / 20, g1 - 2 * d1 / 5 + c1 / 20, g1 - d1 / 5, g1};
  return {*std::min_element(b.begin(), b.end()),
          std::max(std::abs(c0 - cubic0), std::abs(c1 - cubic1)) / 20, Dips(b)};
}

bool IsFar(double h, const GuardJet& begin, const GuardJet& end) {
  const double reach =
      h * std::max(std::abs(begin.rate), std::abs(end.rate)) +
      h * h / 2 * std::max(std::abs(begin.acceleration), std::abs(end.acceleration));
  return std::min(begin.value, end.value) > kFarReach * reach;
}

double CubicPiece::Value(double s) const {
  const double t = 1 - s;
  return t * t * (t * b[0] + 3 * s * b[1]) + s * s * (3 * t * b[2] + s * b[3]);
}

double CubicPiece::Rate(double s) const {
  const double t = 1 - s;
  return 3 * (t * t * (b[1] - b[0]) + 2 * s * t * (b[2] - b[1]) + s * s * (b[3] - b[2]));
}

double CubicPiece::Lowest() const { return std::min({b[0], b[1], b[2], b[3]}); }
double CubicPiece::Highest() const { return std::max({b[0], b[1], b[2], b[3]}); }

bool CubicPiece::TurnsAsEndsTell() const {
  const double first = b[1] - b[0], middle = b[2] - b[1], last = b[3] - b[2];
  if (first * last < 0) return true;
  return (middle * first >= 0 && middle * last >= 0) || middle * middle < first * last;
}

GuardBound StageBound(const StagePlaces& places, const double* values, int stride, bool probed) {
  constexpr int kNodes = StagePlaces::kNodes, kChecks = StagePlaces::kChecks;
  Eigen::Matrix<double, kNodes, 1> nodes;
  for (int k = 0; k < kNodes; ++k) nodes(k) = values[places.nodes[k] * stride];
  double miss = 0;
  const auto check = [&](int row, int column) {
    miss = std::max(miss, std::abs(places.check.row(row).dot(nodes) - values[column * stride]));
  };
  for (int k = 0; k < kChecks; ++k) check(k, places.checks[k]);
  for (int k = 0; probed && k < StagePlaces::kProbes; ++k) {
    check(kChecks + k, places.first_probe() + k);
  }
  std::array<double, 6> b;
  Eigen::Map<Eigen::Matrix<double, kNodes, 1>>(b.data()) = places.bernstein * nodes;
  return {*std::min_element(b.begin(), b.end()), places.reach * miss, Dips(b)};
}

}  // namespace contact_flow
