// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {

/// The member of `valid` with the smallest edit distance to `name`; "" when `valid` is empty.
std::string NearestName(const std::string& name, const std::vector<std::string>& valid);

/// "unknown model 'sft_biped'; did you mean 'soft_biped'?": the message for a name that does not
/// exist.
std::string UnknownName(const std::string& kind, const std::string& name,
                        const std::vector<std::string>& valid);

}  // namespace contact_flow
