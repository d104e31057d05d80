// SPDX-License-Identifier: BSD-3-Clause
// The options by which random runs are made: about half of each are the usual ones.
#include "test/adversary/draw.h"
#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {

Case GenerateWithOptions(std::uint64_t seed) {
  Case result = Generate(seed);
  Draw draw(~seed);
  SimulateOptions& options = result.options;
  const double parts[] = {1, 1, 1, 1e-4, 1e-3, 1e-2, 1e2};
  options.absolute_tolerance *= parts[draw.Below(7)];
  const IntegrationMethod methods[] = {IntegrationMethod::kAutomatic, IntegrationMethod::kAutomatic,
                                       IntegrationMethod::kExplicit, IntegrationMethod::kImplicit};
  options.method = methods[draw.Below(4)];
  const double others[] = {1, 1, 1, 1e-2, 1e2};
  options.gap_tolerance *= others[draw.Below(5)];
  options.speed_tolerance *= others[draw.Below(5)];
  const double together[] = {0, 0, 0, 1e-10, 1e-8};
  options.simultaneity_tolerance = together[draw.Below(5)];
  return result;
}

}  // namespace adversary
}  // namespace contact_flow
