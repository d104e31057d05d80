// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>
#include <string>

namespace contact_flow {
namespace test {

/// What std::invalid_argument of the call says, or "" if there is none.
template <class Call>
std::string RefusalOf(const Call& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace test
}  // namespace contact_flow
