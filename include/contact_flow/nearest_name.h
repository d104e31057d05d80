// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {

/// `text`, or, where it is longer than `length` bytes, its beginning and how long it is: whatever a
/// client sends may get into a message.
std::string Cut(const std::string& text, std::size_t length);
/// 'name' in quotes, cut: for every name in a message that may come from outside.
std::string QuoteName(const std::string& name);

/// The member of `valid` with the smallest edit distance to `name`; "" when `valid` is empty.
std::string NearestName(const std::string& name, const std::vector<std::string>& valid);

/// Whether so few edits make `meant` of `name`: a character put in, left out or replaced, or two
/// neighbours exchanged.
bool IsMisspelt(const std::string& name, const std::string& meant, std::size_t edits);

/// "unknown model 'sft_biped'; did you mean 'soft_biped'?": the message for a name that does not
/// exist. Where no other is like it: "unknown model 'walker'; there are 'puck' and 25 more".
std::string UnknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& valid);

}  // namespace contact_flow
