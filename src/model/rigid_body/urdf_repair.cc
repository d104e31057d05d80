// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_repair.h"

#include <cstddef>
#include <map>

namespace contact_flow {

std::vector<std::string> RepairUrdf(const XmlElement& root, std::string* text) {
  std::vector<std::string> done;
  std::map<std::size_t, std::string> missing;  // text by the place before which it is put
  if (root.name == "robot" && !root.Has("name")) {
    missing[root.begin + 1 + root.name.size()] = " name=\"robot\"";
    done.push_back("the robot has no name: 'robot' is used" + AtLine(root));
  }
  bool has_world = false, needs_world = false;
  for (const XmlElement& part : root.children) {
    has_world |= part.name == "link" && part.Attribute("name") == "world";
    const XmlElement* parent = part.name == "joint" ? part.Child("parent") : nullptr;
    needs_world |= parent != nullptr && parent->Attribute("link") == "world";
  }
  if (needs_world && !has_world) {
    missing[text->rfind("</", root.end - 1)] = "<link name=\"world\"/>";
    done.push_back("joints hang on a link 'world' that is not there: it is added");
  }
  for (const XmlElement& joint : root.children) {
    const std::string type = joint.Attribute("type");
    if (joint.name != "joint" || (type != "revolute" && type != "prismatic")) continue;
    const std::string owner = "joint '" + joint.Attribute("name") + "'";
    const XmlElement* limit = joint.Child("limit");
    if (limit == nullptr) {
      if (joint.children.empty()) continue;
      missing[text->rfind("</", joint.end - 1)] = "<limit effort=\"0\" velocity=\"0\"/>";
      done.push_back(owner + " has no <limit>: it moves without stops" + AtLine(joint));
      continue;
    }
    std::string lacks;
    for (const char* key : {"effort", "velocity"}) {
      if (limit->Has(key)) continue;
      missing[limit->begin + 1 + limit->name.size()] += std::string(" ") + key + "=\"0\"";
      lacks += (lacks.empty() ? "" : " and no ") + std::string(key);
    }
    if (lacks.empty()) continue;
    done.push_back(owner + ": its <limit> has no " + lacks + ", which nothing uses" +
                   AtLine(*limit));
  }
  for (auto it = missing.rbegin(); it != missing.rend(); ++it) text->insert(it->first, it->second);
  return done;
}

}  // namespace contact_flow
