// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

namespace contact_flow {
namespace fuzz {

/// An input of the fuzz targets: a URDF, then optionally this line and a YAML.
inline constexpr char kYamlFollows[] = "\n%%% YAML\n";

/// Loads a robot from the input and, if it is accepted, evaluates its dynamics and their
/// derivatives where it starts. Whatever is wrong must come as std::invalid_argument or as an error
/// of the YAML parser, with words; anything else, and numbers that are not finite from a robot that
/// was accepted, aborts. True when it was accepted.
bool Load(const std::string& input);

/// The robots of config/robots and test/data, and what is known to be hard on parsers: truncated,
/// cyclic, with a million links, without mass, filled with NaN, nested deeply.
std::vector<std::string> Seeds();

}  // namespace fuzz
}  // namespace contact_flow
