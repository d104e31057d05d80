// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/model/configuration_factors.h"

#include <algorithm>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

const std::vector<std::string> kNames = {"line", "circle", "rotation"};  // as Factor

/// Further than half way around a circle [rad].
constexpr double kBeyond = 4;

}  // namespace

std::vector<std::string> FactorNames(const ConfigurationSpace& space) {
  Vector origin = Vector::Zero(space.num_positions());
  for (const auto& rotation : space.rotations()) origin(rotation.q) = 1;
  std::vector<std::string> names;
  for (int k = 0; k < space.num_positions(); ++k) {
    const int v = space.line_velocities()[static_cast<std::size_t>(k)];
    if (v < 0) {
      names.push_back("rotation");
      k += 3;
      continue;
    }
    // On a circle the shortest way there goes through its other side.
    Vector far = origin;
    far(k) = kBeyond;
    names.push_back(space.Difference(far, origin)(v) == kBeyond ? "line" : "circle");
  }
  return names;
}

ConfigurationSpace SpaceOfFactors(const std::string& field, const std::vector<std::string>& names) {
  ConfigurationSpace space;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = std::find(kNames.begin(), kNames.end(), names[k]);
    if (at == kNames.end()) {
      throw std::invalid_argument(
          UnknownName(field + "[" + std::to_string(k) + "]", names[k], kNames));
    }
    space.Append(static_cast<ConfigurationSpace::Factor>(at - kNames.begin()));
  }
  return space;
}

}  // namespace contact_flow
