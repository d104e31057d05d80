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

/// "unknown model 'sft_biped'; did you mean 'soft_biped'?": the message for a name
/// that does not exist.
std::string UnknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& valid);

}  // namespace contact_flow
