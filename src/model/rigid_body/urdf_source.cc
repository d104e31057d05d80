// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_source.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <stdexcept>

#include "contact_flow/model/rigid_body/kinematics.h"
#include "urdf_repair.h"
#include "urdf_spelling.h"
#include "urdf_xacro.h"
#include "urdf_xml.h"

namespace contact_flow {
namespace {

constexpr std::size_t kMostTold = 40;

void Blank(const XmlElement& element, std::string* text) {
  for (std::size_t k = element.begin; k < element.end; ++k) {
    if ((*text)[k] != '\n') (*text)[k] = ' ';
  }
}

/// Puts spaces within the quotes of values, at their ends, outside: urdfdom reads no number with
/// them. Lines stay where they are.
void TrimValues(std::string* text) {
  const auto is_space = [&](std::size_t k) {
    return std::isspace(static_cast<unsigned char>((*text)[k])) != 0;
  };
  char before = 0;  // the last that is no space
  for (std::size_t at = 0; at < text->size(); ++at) {
    const char letter = (*text)[at];
    if (text->compare(at, 4, "<!--") == 0) {
      at = text->find("-->", at);
      if (at == std::string::npos) return;
    } else if ((letter == '"' || letter == '\'') && before == '=') {
      std::size_t end = text->find(letter, at + 1);
      if (end == std::string::npos) return;
      for (; end > at + 1 && is_space(end - 1); --end) std::swap((*text)[end], (*text)[end - 1]);
      for (; at + 1 < end && is_space(at + 1); ++at) std::swap((*text)[at], (*text)[at + 1]);
      at = end;
    }
    if (!is_space(at)) before = (*text)[at];
  }
}

bool IsXacro(const std::string& text) {
  return text.find("${") != std::string::npos || text.find("$(") != std::string::npos;
}

/// Complains of attributes of `element` that hold no numbers, or not `count`.
void CheckNumbers(const XmlElement& element, const std::vector<std::string>& keys, int count,
                  const std::string& owner, Findings* findings) {
  for (const std::string& key : keys) {
    if (!element.Has(key)) continue;
    const std::string value = element.Attribute(key);
    double numbers[3];
    if (ReadNumbers(value, count, numbers)) continue;
    findings->errors.push_back(
        owner + ": " + element.name + " " + key + "=\"" + value.substr(0, 60) + "\" is not " +
        (count == 1 ? "a finite number" : std::to_string(count) + " finite numbers") +
        (IsXacro(value) ? ": this is xacro text; run xacro on the file first" : "") +
        AtLine(element));
  }
}

void CheckLink(const XmlElement& link, const std::string& owner, Findings* findings) {
  const XmlElement* inertial = link.Child("inertial");
  if (!inertial) return;
  for (const XmlElement& part : inertial->children) {
    if (part.name == "origin") CheckNumbers(part, {"xyz", "rpy"}, 3, owner, findings);
    if (part.name == "mass") CheckNumbers(part, {"value"}, 1, owner, findings);
    if (part.name == "inertia") {
      CheckNumbers(part, {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"}, 1, owner, findings);
    }
  }
}

void CheckJoint(const XmlElement& joint, const std::string& owner, Findings* findings) {
  for (const XmlElement& part : joint.children) {
    if (part.name == "origin") CheckNumbers(part, {"xyz", "rpy"}, 3, owner, findings);
    if (part.name == "axis") CheckNumbers(part, {"xyz"}, 3, owner, findings);
    if (part.name == "limit") {
      CheckNumbers(part, {"lower", "upper", "effort", "velocity"}, 1, owner, findings);
    }
    if (part.name == "dynamics") CheckNumbers(part, {"damping", "friction"}, 1, owner, findings);
    if (part.name == "mimic") CheckNumbers(part, {"multiplier", "offset"}, 1, owner, findings);
  }
}

/// Zero where absent; false where it cannot be read.
bool ReadOrigin(const XmlElement* origin, Pose* pose) {
  double xyz[3] = {}, rpy[3] = {};
  if (!origin) return true;
  if (origin->Has("xyz") && !ReadNumbers(origin->Attribute("xyz"), 3, xyz)) return false;
  if (origin->Has("rpy") && !ReadNumbers(origin->Attribute("rpy"), 3, rpy)) return false;
  pose->rotation = (Eigen::AngleAxisd(rpy[2], Vec3<double>::UnitZ()) *
                    Eigen::AngleAxisd(rpy[1], Vec3<double>::UnitY()) *
                    Eigen::AngleAxisd(rpy[0], Vec3<double>::UnitX()))
                       .toRotationMatrix();
  pose->position = {xyz[0], xyz[1], xyz[2]};
  return true;
}

/// Reads one <collision>; "" or what is wrong with it.
std::string ReadShape(const XmlElement& collision, RobotModel::Shape* shape) {
  using Kind = RobotModel::Shape::Kind;
  shape->line = collision.line;
  shape->size.setZero();
  if (!ReadOrigin(collision.Child("origin"), &shape->pose)) return "its origin cannot be read";
  const XmlElement* geometry = collision.Child("geometry");
  if (!geometry || geometry->children.empty()) return "it has no geometry";
  const XmlElement& kind = geometry->children.front();
  double* size = shape->size.data();
  bool right = true;
  if (kind.name == "box") {
    shape->kind = Kind::kBox;
    right = ReadNumbers(kind.Attribute("size"), 3, size);
  } else if (kind.name == "sphere") {
    shape->kind = Kind::kSphere;
    right = ReadNumbers(kind.Attribute("radius"), 1, size);
  } else if (kind.name == "cylinder" || kind.name == "capsule") {
    shape->kind = kind.name == "cylinder" ? Kind::kCylinder : Kind::kCapsule;
    right = ReadNumbers(kind.Attribute("radius"), 1, size) &&
            ReadNumbers(kind.Attribute("length"), 1, size + 1);
  } else if (kind.name == "mesh") {
    shape->kind = Kind::kMesh;
    shape->mesh = kind.Attribute("filename");
    right = ReadNumbers(kind.Attribute("scale", "1 1 1"), 3, size) && !shape->mesh.empty();
  } else {
    return "its geometry '" + kind.name.substr(0, 60) +
           "' is none of box, sphere, cylinder, capsule, mesh";
  }
  if (!right) return "the numbers of its " + kind.name + " cannot be read";
  if (shape->kind != Kind::kMesh && shape->size.minCoeff() < 0) {
    return "its " + kind.name + " has a negative size";
  }
  return "";
}

template <class Names>
bool Contains(const Names& names, const std::string& name) {
  return std::find(std::begin(names), std::end(names), name) != std::end(names);
}

}  // namespace

void Findings::ThrowIfAny() const {
  if (errors.empty()) return;
  if (errors.size() == 1) throw std::invalid_argument("URDF: " + errors[0]);
  std::string text = "URDF: " + std::to_string(errors.size()) + " findings";
  for (std::size_t k = 0; k < errors.size() && k < kMostTold; ++k) text += "\n  " + errors[k];
  if (errors.size() > kMostTold) text += "\n  …";
  throw std::invalid_argument(text);
}

UrdfSource SortUrdf(const std::string& text, UrdfFaults faults, Findings* findings) {
  static const char* const kOfLink[] = {"inertial"};
  static const char* const kOfJoint[] = {"parent", "child",    "origin", "axis",
                                         "limit",  "dynamics", "mimic"};
  UrdfSource source;
  source.text = text;
  const XmlElement root = ReadXml(text);
  std::map<std::string, int> passed_over;
  for (const XmlElement& part : root.children) {
    const bool link = part.name == "link";
    if (!link && part.name != "joint") {
      if (part.name != "material") ++passed_over[part.name.substr(0, 60)];
      Blank(part, &source.text);
      continue;
    }
    const std::string name = part.Attribute("name");
    const std::string owner = part.name + " '" + name + "'";
    if (link) {
      CheckLink(part, owner, findings);
    } else {
      CheckJoint(part, owner, findings);
    }
    for (const XmlElement& child : part.children) {
      if (link && child.name == "collision") {
        RobotModel::Shape shape;
        const std::string wrong = ReadShape(child, &shape);
        if (wrong.empty()) {
          source.shapes[name].push_back(shape);
        } else {
          findings->warnings.push_back(owner + ": a collision is passed over: " + wrong +
                                       AtLine(child));
        }
      }
      if (link ? !Contains(kOfLink, child.name) : !Contains(kOfJoint, child.name)) {
        Blank(child, &source.text);
      }
    }
  }
  const XacroTags xacro = FindXacro(root);
  if (xacro.runs) {
    findings->errors.push_back("the file holds xacro macros: run xacro on it first");
  } else if (!xacro.undefined.empty()) {
    findings->errors.push_back(UndefinedMacro(xacro.undefined));
  }
  if (xacro.passed_over > 0 && !xacro.needed()) {
    findings->warnings.push_back("passed over: " + std::to_string(xacro.passed_over) +
                                 " calls of xacro's macros in parts that are not read, the first " +
                                 xacro.passed_over_one);
  }
  if (!xacro.needed() && !passed_over.empty()) {
    std::string list;
    for (const auto& entry : passed_over) {
      list += (list.empty() ? "" : ", ") + std::to_string(entry.second) + " <" + entry.first + ">";
    }
    findings->warnings.push_back("passed over: " + list);
  }
  auto& told = faults == UrdfFaults::kStrict ? findings->errors : findings->warnings;
  source.unknown_names = FindUnknownNames(root);
  told.insert(told.end(), source.unknown_names.begin(), source.unknown_names.end());
  for (const std::string& repair : RepairUrdf(root, &source.text)) told.push_back(repair);
  TrimValues(&source.text);
  return source;
}

std::string UrdfStructure(const std::string& text) {
  Findings findings;
  const std::string trimmed = text.substr(0, text.find_last_not_of('\0') + 1);
  return SortUrdf(trimmed, UrdfFaults::kLenient, &findings).text;
}

}  // namespace contact_flow
