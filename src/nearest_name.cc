// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/nearest_name.h"

#include <algorithm>
#include <numeric>

namespace contact_flow {
namespace {

constexpr std::size_t kLongestName = 60;  // that is quoted in full [bytes]

/// Levenshtein distance.
std::size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row.back();
}

}  // namespace

std::string Cut(const std::string& text, std::size_t length) {
  if (text.size() <= length) return text;
  std::size_t end = length;  // not within a UTF-8 character
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
  return text.substr(0, end) + "… (" + std::to_string(text.size()) + " bytes)";
}

std::string QuoteName(const std::string& name) { return "'" + Cut(name, kLongestName) + "'"; }

std::string NearestName(const std::string& name, const std::vector<std::string>& valid) {
  const std::string key = name.substr(0, 256);  // absurdly long names cost no more than long ones
  const auto nearest = std::min_element(
      valid.begin(), valid.end(),
      [&](const auto& a, const auto& b) { return EditDistance(key, a) < EditDistance(key, b); });
  return nearest == valid.end() ? "" : *nearest;
}

std::string UnknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& valid) {
  const std::string nearest = NearestName(name, valid);
  return "unknown " + kind + " " + QuoteName(name) +
         (nearest.empty() ? "; there is none" : "; did you mean '" + nearest + "'?");
}

}  // namespace contact_flow
