// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/nearest_name.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace contact_flow {
namespace {

constexpr std::size_t kLongestName = 60;  // that is quoted in full [bytes]
constexpr std::size_t kMostNames = 8;     // of a list in a message

/// Edits that make b of a: a character put in, left out or replaced, or two neighbours exchanged
/// (optimal string alignment).
std::size_t EditDistance(const std::string& a, const std::string& b) {
  // Distances of the beginnings of b from those of a: of its first i − 2, i − 1 and i characters.
  std::vector<std::size_t> before, last, row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    before = std::move(last);
    last = row;
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, substituted});
      const bool exchanged = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (exchanged) row[j] = std::min(row[j], before[j - 2] + 1);
    }
  }
  return row.back();
}

/// "'a', 'b' and 3 more".
std::string NamesInQuotes(const std::vector<std::string>& names) {
  std::string text;
  const std::size_t told = names.size() <= kMostNames ? names.size() : kMostNames - 1;
  for (std::size_t k = 0; k < told; ++k) text += (k ? ", " : "") + QuoteName(names[k]);
  if (told < names.size()) text += " and " + std::to_string(names.size() - told) + " more";
  return text;
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

bool IsMisspelt(const std::string& name, const std::string& meant, std::size_t edits) {
  return name.size() <= meant.size() + edits && EditDistance(name, meant) <= edits;
}

std::string UnknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& valid) {
  const std::string unknown = "unknown " + kind + " " + QuoteName(name);
  if (valid.empty()) return unknown + "; there is none";
  const std::string nearest = NearestName(name, valid);
  if (IsMisspelt(name, nearest, std::max<std::size_t>(2, name.size() / 2))) {
    return unknown + "; did you mean '" + nearest + "'?";
  }
  return unknown + "; there " + (valid.size() == 1 ? "is " : "are ") + NamesInQuotes(valid);
}

}  // namespace contact_flow
