// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_xacro.h"

#include <algorithm>
#include <iterator>

namespace contact_flow {
namespace {

constexpr std::size_t kXacroPrefix = 6, kLongestXacroTag = 60;
const char* const kDefinitions[] = {"xacro:macro", "xacro:property", "xacro:arg", "xacro:include"};
const char* const kStatements[] = {"xacro:if",        "xacro:unless", "xacro:element",
                                   "xacro:attribute", "xacro:call",   "xacro:insert_block"};
/// Elements in which a macro could add what is read.
const char* const kReadWithin[] = {"robot", "link", "joint", "inertial", "collision", "geometry"};

template <class Names>
bool IsTagOf(const Names& names, const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

void WalkXacro(const XmlElement& element, bool read, XacroTags* tags) {
  read = read && IsTagOf(kReadWithin, element.name);
  for (const XmlElement& part : element.children) {
    if (part.name.compare(0, kXacroPrefix, "xacro:") == 0) {
      const std::string told = "<" + part.name.substr(0, kLongestXacroTag) + "/>" + AtLine(part);
      if (IsTagOf(kDefinitions, part.name) || (read && IsTagOf(kStatements, part.name))) {
        tags->runs = true;
      } else if (read) {
        if (tags->undefined.empty()) tags->undefined = told;
      } else if (tags->passed_over++ == 0) {
        tags->passed_over_one = told;
      }
    }
    WalkXacro(part, read, tags);
  }
}

}  // namespace

XacroTags FindXacro(const XmlElement& root) {
  XacroTags tags;
  WalkXacro(root, true, &tags);
  return tags;
}

std::string UndefinedMacro(const std::string& tag) {
  return tag +
         " calls a macro of xacro that the file neither defines nor includes, and that may have "
         "added links or joints: delete the tag if it did not, or run xacro on the file that this "
         "one was made of";
}

}  // namespace contact_flow
