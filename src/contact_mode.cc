// SPDX-License-Identifier: BSD-3-Clause
#include "contact_flow/contact_mode.h"

namespace contact_flow {

std::string ContactMode::Word(int n) const {
  std::string word;
  for (int i = 0; i < n; ++i) word += static_cast<char>(LetterOf(i));
  return word;
}

}  // namespace contact_flow
