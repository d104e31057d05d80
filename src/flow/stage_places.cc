// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/flow/stage_places.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <initializer_list>

#include "contact_flow/flow/radau_rule.h"
#include "dop853_tableau.h"

namespace contact_flow {
namespace {

constexpr int kNodes = StagePlaces::kNodes, kChecks = StagePlaces::kChecks;
/// Reserve on top of what the shape of the leading error tells.
constexpr double kStageReserve = 1.16;
constexpr int kScan = 200;

Eigen::Matrix<double, 1, kNodes> Basis(double s) {
  static constexpr double kBinomial[kNodes] = {1, 5, 10, 10, 5, 1};
  Eigen::Matrix<double, 1, kNodes> row;
  for (int k = 0; k < kNodes; ++k) {
    row(k) = kBinomial[k] * std::pow(s, k) * std::pow(1 - s, kNodes - 1 - k);
  }
  return row;
}

void FindMaps(StagePlaces* places) {
  Eigen::Matrix<double, kNodes, kNodes> values;
  for (int k = 0; k < kNodes; ++k) values.row(k) = Basis(places->at[places->nodes[k]]);
  places->bernstein = values.inverse();
  for (int k = 0; k < kChecks; ++k) {
    places->check.row(k) = Basis(places->at[places->checks[k]]) * places->bernstein;
  }
  for (int k = 0; k < StagePlaces::kProbes; ++k) {
    places->check.row(kChecks + k) =
        Basis(places->at[places->first_probe() + k]) * places->bernstein;
  }
}

/// max |Π(θ − θ_node)| over the step, over its largest value at a check.
double LargestMiss(const StagePlaces& places) {
  const auto shape = [&](double theta) {
    double product = 1;
    for (int node : places.nodes) product *= theta - places.at[node];
    return std::abs(product);
  };
  double inside = 0, seen = 0;
  for (int k = 0; k <= kScan; ++k) inside = std::max(inside, shape(k / double{kScan}));
  for (int k : places.checks) seen = std::max(seen, shape(places.at[k]));
  return inside / seen;
}

/// The 12 stages and the end; nodes are stages of high order, spread over the step. Probes between
/// them: no hole is larger than 1/7 then.
StagePlaces Explicit() {
  StagePlaces places;
  places.stages = dop853::kStages + 1;
  places.end = dop853::kStages;
  places.later = 0;
  places.extended = false;
  for (int stage = 0; stage < dop853::kStages; ++stage) {
    places.at[stage] = 0;
    for (int k = 0; k < stage; ++k) places.at[stage] += dop853::kA[stage][k];
  }
  places.at[places.end] = 1;
  places.at[13] = 0.4667;
  places.at[14] = 0.7542;
  places.nodes = {0, 3, 5, 8, 10, 12};
  places.checks = {2, 6, 7, 9};
  places.reach = 2;  // LargestMiss is 1.72
  FindMaps(&places);
  return places;
}

/// The beginning, s − 1 stages, the two places where the defect is looked at, and the end.
StagePlaces Implicit(int s, std::initializer_list<double> later, std::array<int, kNodes> nodes,
                     std::array<int, kChecks> checks, std::array<double, 2> probes) {
  const RadauRule& rule = RadauRule::WithStages(s);
  StagePlaces places;
  places.at[0] = 0;
  for (int k = 0; k + 1 < s; ++k) places.at[k + 1] = rule.c(k);
  for (int k = 0; k < 2; ++k) places.at[s + k] = rule.check[k];
  places.end = s + 2;
  places.at[places.end] = 1;
  places.stages = s + 3;
  places.later = static_cast<int>(later.size());
  places.extended = true;
  std::copy(later.begin(), later.end(), &places.at[places.stages]);
  std::copy(probes.begin(), probes.end(), &places.at[places.first_probe()]);
  places.nodes = nodes;
  places.checks = checks;
  places.reach = kStageReserve * LargestMiss(places);
  FindMaps(&places);
  return places;
}

}  // namespace

const StagePlaces& StagePlaces::OfDop853() {
  static const StagePlaces places = Explicit();
  return places;
}

const StagePlaces& StagePlaces::OfRadau(int stages) {
  // Stages of 5: 0 .057 .277 .584 .860, .43 .72, 1; of 3: 0 .155 .645, .39 .84, 1. No hole is
  // larger than 4/15, nor, with what is looked at beside them, than 1/7.
  static const StagePlaces five =
      Implicit(5, {0.155, 0.94}, {0, 1, 2, 3, 4, 7}, {5, 6, 8, 9}, {0.355, 0.51});
  static const StagePlaces three =
      Implicit(3, {0.065, 0.275, 0.53, 0.745}, {0, 1, 3, 2, 4, 5}, {6, 7, 8, 9}, {0.93, 0.455});
  return stages == 5 ? five : three;
}

}  // namespace contact_flow
