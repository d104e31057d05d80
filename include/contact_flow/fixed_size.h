// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <type_traits>

namespace contact_flow {

/// Calls f(n) with n as a compile-time constant when it is small, so that loops to n unroll: the
/// numbers of coordinates and contacts are known only at run time, and most are small.
template <class Function>
void WithFixedSize(int n, Function&& f) {
  switch (n) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    case 3:
      return f(std::integral_constant<int, 3>());
    case 4:
      return f(std::integral_constant<int, 4>());
    case 5:
      return f(std::integral_constant<int, 5>());
    case 6:
      return f(std::integral_constant<int, 6>());
    case 7:
      return f(std::integral_constant<int, 7>());
    case 8:
      return f(std::integral_constant<int, 8>());
    default:
      return f(n);
  }
}

}  // namespace contact_flow
