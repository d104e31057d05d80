// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "urdf_xml.h"

namespace contact_flow {

/// What of xacro is in a file.
struct XacroTags {
  bool runs = false;            ///< a program: definitions, or conditions where a robot is read
  std::string undefined;        ///< "<xacro:leg/> (line 4)": the first call where a robot is read
  int passed_over = 0;          ///< calls in parts that are not read, as <visual> and <gazebo>
  std::string passed_over_one;  ///< the first of them
  /// Whether the file cannot be read as it is.
  bool needed() const { return runs || !undefined.empty(); }
};

XacroTags FindXacro(const XmlElement& root);

/// What to do about a call that nothing in the file defines.
std::string UndefinedMacro(const std::string& tag);

}  // namespace contact_flow
