// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/contact_mode.h"

namespace contact_flow {

std::string ContactMode::Word(int n) const {
  std::string word;
  for (int i = 0; i < n; ++i) word += static_cast<char>(LetterOf(i));
  return word;
}

std::vector<std::string> ContactMode::Names(const std::vector<std::string>& constraints) const {
  std::vector<std::string> names;
  for (int i : *this) names.push_back(constraints[i]);
  return names;
}

std::string ContactMode::ToString(const std::vector<std::string>& constraints) const {
  std::string text = "{";
  for (int i : *this) text += (text.size() > 1 ? ", " : "") + constraints[i];
  return text + "}";
}

}  // namespace contact_flow
