// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "contact_flow/contact_mode.h"

namespace contact_flow {

/// The mode of a word, "s-o", one letter for each of n constraints: ContactMode::Word backward.
/// Throws std::invalid_argument, naming `field` and word, for another length or letter.
ContactMode ModeOfWord(const std::string& field, const std::string& word, int n);

/// The set of these names. Throws std::invalid_argument, naming `field` and entry, for one that is
/// not among the constraints.
ConstraintSet SetOfNames(const std::string& field, const std::vector<std::string>& names,
                         const std::vector<std::string>& constraints);

}  // namespace contact_flow
