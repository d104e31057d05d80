// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <random>
#include <string>
#include <vector>

namespace contact_flow {
namespace test {

/// The text with one to three changes: a byte overwritten, up to `longest` bytes lost or doubled
/// elsewhere, or one of `pieces` put in. Depends on the generator alone, on any machine.
inline std::string Damaged(std::string text, const std::vector<const char*>& pieces,
                           std::size_t longest, std::mt19937* generator) {
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>((*generator)() % std::max<std::size_t>(n, 1));
  };
  for (std::size_t edits = 1 + below(3); edits-- > 0 && !text.empty();) {
    const std::size_t at = below(text.size()), length = below(longest);
    switch (below(4)) {
      case 0:
        text[at] = static_cast<char>(below(256));
        break;
      case 1:
        text.erase(at, length);
        break;
      case 2:
        text.insert(below(text.size()), text.substr(at, length));
        break;
      default:
        text.insert(at, pieces[below(pieces.size())]);
    }
  }
  return text;
}

}  // namespace test
}  // namespace contact_flow
