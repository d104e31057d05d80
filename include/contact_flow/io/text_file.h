// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <string>

namespace contact_flow {

/// Longest YAML file of a configuration [bytes].
inline constexpr std::size_t kMaxConfigurationBytes = std::size_t{1} << 20;

/// The text of a regular file, at most `longest` + 1 bytes of it, however long it is. Throws
/// std::invalid_argument, with path and reason, for one that cannot be read, and for what is no
/// file: a FIFO would keep its reader waiting for ever.
std::string ReadTextFile(const std::string& path, std::size_t longest);

/// The one document of a YAML text; null for an empty text. Throws std::invalid_argument where a
/// second document begins, which would not be read, and YAML::Exception.
YAML::Node ParseYamlDocument(const std::string& text);

}  // namespace contact_flow
