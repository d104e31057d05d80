// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_lines.h"

#include <sstream>

#include "urdf_xml.h"

namespace contact_flow {

UrdfLines::UrdfLines(const std::string& text) {
  for (const XmlElement& part : ReadXml(text).children) {
    if (part.name == "link") links_.emplace(part.Attribute("name"), part.line);
    if (part.name == "joint") joints_.emplace(part.Attribute("name"), part.line);
  }
}

std::string UrdfLines::Told(const std::string& message) const {
  std::istringstream lines(message);
  std::string told, line;
  while (std::getline(lines, line)) told += (told.empty() ? "" : "\n") + line + OfFinding(line);
  return told;
}

std::string UrdfLines::OfFinding(const std::string& finding) const {
  if (finding.find("(line ") != std::string::npos) return "";
  for (std::size_t at = 0; (at = finding.find_first_of("'[", at)) != std::string::npos; ++at) {
    const std::size_t end = finding.find(finding[at] == '[' ? ']' : '\'', at + 1);
    if (end == std::string::npos) break;
    const std::string name = finding.substr(at + 1, end - at - 1);
    const bool of_link = at >= 5 && finding.compare(at - 5, 5, "link ") == 0;
    for (const auto* kind : {of_link ? &links_ : &joints_, of_link ? &joints_ : &links_}) {
      const auto found = kind->find(name);
      if (found != kind->end()) return " (line " + std::to_string(found->second) + ")";
    }
    at = end;
  }
  return "";
}

}  // namespace contact_flow
