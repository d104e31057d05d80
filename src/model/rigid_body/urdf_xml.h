// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace contact_flow {

/// An element of an XML text and where it is.
struct XmlElement {
  std::string name;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<XmlElement> children;
  std::size_t begin = 0, end = 0;  ///< from its '<' to behind its last '>'
  int line = 0;

  /// The value of an attribute; `otherwise` where there is none.
  std::string Attribute(const std::string& key, const std::string& otherwise = "") const;
  bool Has(const std::string& key) const;
  /// The first child of this name; null where there is none.
  const XmlElement* Child(const std::string& child) const;
};

/// " (line 7)", behind what is said of an element.
std::string AtLine(const XmlElement& element);

/// The root of a text that CheckUrdfText has passed.
XmlElement ReadXml(const std::string& text);

/// "1.5 -2 3" into `count` numbers, as urdfdom reads them; false for anything else.
bool ReadNumbers(const std::string& text, int count, double* numbers);

}  // namespace contact_flow
