// SPDX-License-Identifier: BSD-3-Clause
#include "row_units.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace contact_flow {
namespace {

/// Units that differ from 1 by less are 1.
constexpr double kSameUnit = 1e-12;
/// What accelerations of rows are known to, relative to those of the whole.
constexpr double kKnown = 1e-13;

double NearestPowerOfTwo(double x) { return std::exp2(std::round(std::log2(x))); }

}  // namespace

bool StandsAlone(const FrictionProblem& problem, std::size_t i) {
  const FrictionContact& contact = problem.contacts[i];
  if (contact.dimension == 0 || !std::isfinite(contact.coefficient)) return false;
  const Matrix& G = problem.G;
  const int row = problem.Row(i);
  if (!(G(row, row) > 0) || !(G(row + 1, row + 1) > 0)) return false;
  for (Eigen::Index j = 0; j < G.cols(); ++j) {
    const double felt = std::numeric_limits<double>::epsilon() * std::sqrt(G(row, row) * G(j, j));
    if (j != row && !(std::abs(G(row, j)) <= felt)) return false;
  }
  return true;
}

RowUnits::RowUnits(const FrictionProblem& problem) {
  const Vector diagonal = problem.G.diagonal();
  force_ = rate_ = Vector::Ones(diagonal.size());
  std::vector<bool> alone;
  double sum = 0, logarithms = 0;
  int rows = 0, count = 0;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    alone.push_back(StandsAlone(problem, i));
    const int row = problem.Row(i), dimension = problem.contacts[i].dimension;
    if (alone.back()) {
      logarithms += std::log(diagonal.segment(row + 1, dimension).maxCoeff());
      ++count;
    } else {
      sum += diagonal.segment(row, 1 + dimension).sum();
      rows += 1 + dimension;
    }
  }
  if (count == 0) return;
  const double mean = rows > 0 ? sum / rows : std::exp(logarithms / count);
  if (!(mean > 0) || !std::isfinite(mean)) return;
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    if (!alone[i]) continue;
    const FrictionContact& contact = problem.contacts[i];
    const int row = problem.Row(i);
    double unit = std::sqrt(mean / diagonal.segment(row + 1, contact.dimension).maxCoeff());
    if (std::abs(unit - 1) <= kSameUnit) unit = 1;
    force_.segment(row + 1, contact.dimension).setConstant(unit);
    rate_.segment(row + 1, contact.dimension).setConstant(unit);
    if (problem.b.size() > 0 && problem.b(row) < 0) {
      force_(row) = NearestPowerOfTwo(unit / contact.coefficient);
      rate_(row) = NearestPowerOfTwo(mean / (diagonal(row) * force_(row)));
    }
  }
  any_ = !(force_.array() == 1).all() || !(rate_.array() == 1).all();
}

FrictionProblem RowUnits::Scaled(const FrictionProblem& problem) const {
  FrictionProblem scaled = problem;
  scaled.G = rate_.asDiagonal() * problem.G * force_.asDiagonal();
  scaled.b = rate_.cwiseProduct(problem.b);
  if (problem.rounding.size() > 0) scaled.rounding = rate_.cwiseProduct(problem.rounding);
  for (std::size_t i = 0; i < problem.contacts.size(); ++i) {
    const int row = problem.Row(i);
    if (problem.slack.size() > 0) scaled.slack(static_cast<Eigen::Index>(i)) *= rate_(row);
    FrictionContact& contact = scaled.contacts[i];
    if (contact.dimension > 0) contact.coefficient *= force_(row) / force_(row + 1);
  }
  return scaled;
}

double RowUnits::Largest(const Vector& b) const {
  return b.size() > 0 ? rate_.cwiseProduct(b).cwiseAbs().maxCoeff() : 0;
}

void RowUnits::Return(FrictionSolution* solution) const {
  solution->force = force_.cwiseProduct(solution->force).eval();
  if (solution->interior.size() > 0) {
    solution->interior = force_.cwiseProduct(solution->interior).eval();
  }
  solution->result = solution->result.cwiseQuotient(rate_).eval();
}

Vector AccelerationRounding(const FrictionProblem& problem, const RowUnits& units, double energy) {
  const auto count = static_cast<Eigen::Index>(problem.contacts.size());
  Vector rate(count), gain(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const int row = problem.Row(static_cast<std::size_t>(k));
    const double force = units.force()(row), own = problem.G(row, row);
    rate(k) = units.rate()(row);
    gain(k) = rate(k) * own * force;
    energy += problem.b(row) * problem.b(row) / own * (rate(k) / force - 1);
  }
  // |A P h| ≤ |√P Aᵀ| |√P h|
  const double size = std::sqrt(std::max(0.0, energy));
  return (kKnown * size) * gain.cwiseSqrt().cwiseQuotient(rate);
}

}  // namespace contact_flow
