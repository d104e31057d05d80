// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace test {

/// The models of the library whose contacts have no friction. Those that have are held to the laws
/// of friction, in test/friction.
inline std::vector<std::string> FrictionlessModels() {
  std::vector<std::string> names;
  for (const std::string& name : ModelNames()) {
    if (!MakeModel(name)->HasFriction()) names.push_back(name);
  }
  return names;
}

/// Those with friction.
inline std::vector<std::string> ModelsWithFriction() {
  std::vector<std::string> names;
  for (const std::string& name : ModelNames()) {
    if (MakeModel(name)->HasFriction()) names.push_back(name);
  }
  return names;
}

}  // namespace test
}  // namespace contact_flow
