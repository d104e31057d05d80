// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "urdf_xml.h"

namespace contact_flow {

/// Tags of links and joints, and tags and attributes in them, that no program is known to read, as
/// misspelt ones: a line each, with its link or joint, line of the file and what may be meant. What
/// is the same in several places is told of the first, and counted. Names with a colon are others'
/// and not judged, nor is anything within <visual> and other parts that are not read.
std::vector<std::string> FindUnknownNames(const XmlElement& root);

}  // namespace contact_flow
