// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdlib>

namespace contact_flow {
namespace test {

/// The number in an environment variable, which makes a test longer or tells it where to begin.
inline long FromEnvironment(const char* name, long otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atol(text);
}

}  // namespace test
}  // namespace contact_flow
