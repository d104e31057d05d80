// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/mode_text.h"

#include <algorithm>
#include <stdexcept>

#include "contact_flow/nearest_name.h"

namespace contact_flow {

ContactMode ModeOfWord(const std::string& field, const std::string& word, int n) {
  const bool letters = word.find_first_not_of("ols+-") == std::string::npos;
  if (!letters || word.size() != static_cast<std::size_t>(n)) {
    throw std::invalid_argument(field + " is " + QuoteName(word) + ", expected " +
                                std::to_string(n) + " letters of o, l, s, + and -");
  }
  ContactMode mode;
  for (int i = 0; i < n; ++i) mode.Set(i, static_cast<Letter>(word[static_cast<std::size_t>(i)]));
  return mode;
}

ConstraintSet SetOfNames(const std::string& field, const std::vector<std::string>& names,
                         const std::vector<std::string>& constraints) {
  ConstraintSet set;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = std::find(constraints.begin(), constraints.end(), names[k]);
    if (at == constraints.end()) {
      throw std::invalid_argument(
          UnknownName(field + "[" + std::to_string(k) + "]", names[k], constraints));
    }
    set.Insert(static_cast<int>(at - constraints.begin()));
  }
  return set;
}

}  // namespace contact_flow
