// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "robot_parts.h"

namespace contact_flow {
namespace {

std::string Plain(double number) {
  std::ostringstream text;
  text << number;
  return text.str();
}

/// The number of this name; null where there is none.
const double* NumberOf(const ElementParts& parts, const std::string& name) {
  for (const auto& number : parts.numbers) {
    if (number.name == name) return &number.value;
  }
  return nullptr;
}

/// Whether any value below a node is this text.
bool Mentions(const YAML::Node& node, const std::string& text) {
  if (!node.IsDefined()) return false;
  if (node.IsScalar()) return node.Scalar() == text;
  if (node.IsSequence()) {
    return std::any_of(node.begin(), node.end(),
                       [&](const auto& entry) { return Mentions(YAML::Node(entry), text); });
  }
  if (!node.IsMap()) return false;
  return std::any_of(node.begin(), node.end(),
                     [&](const auto& entry) { return Mentions(entry.second, text); });
}

}  // namespace

void CheckStairs(const ElementParts& parts, const MapReader& reader) {
  const double* first = NumberOf(parts, "first");
  const double* last = NumberOf(parts, "last");
  if (first == nullptr || last == nullptr || *last > *first) return;
  throw std::invalid_argument(parts.name + "/last is " + Plain(*last) + ", not beyond first, " +
                              Plain(*first) +
                              ": no step would rise; stairs that go down have a "
                              "negative rise" +
                              reader.Line("last"));
}

void CheckGear(const ElementParts& parts, const MapReader& reader) {
  const double* gear = NumberOf(parts, "gear");
  if (gear == nullptr || *gear != 0) return;
  throw std::invalid_argument(parts.name + "/gear is 0, so that its input would do nothing" +
                              reader.Line("gear"));
}

void CheckSoles(const YAML::Node& document, const RobotModel& model) {
  const YAML::Node soles = document["soles"];
  if (!soles.IsDefined() || !soles.IsMap()) return;
  MapReader reader(soles, "soles");
  for (const std::string& name : reader.Keys()) {
    const std::string sole = name + "_sole";
    const bool has_shape = std::any_of(
        model.shapes.begin(), model.shapes.end(),
        [&](const RobotModel::Shape& shape) { return model.links[shape.link].name == sole; });
    if (has_shape) continue;
    const auto mentioned = [&](const char* key) { return Mentions(document[key], sole); };
    if (mentioned("constraints") || mentioned("contacts_made") || mentioned("closures") ||
        mentioned("efforts")) {
      continue;
    }
    throw std::invalid_argument("soles/" + name + ": link '" + name +
                                "' has no <collision> in the URDF that the sole could take, and "
                                "nothing names '" +
                                sole + "': give the link one, or write constraints of '" + sole +
                                "'" + reader.Line(name));
  }
}

}  // namespace contact_flow
