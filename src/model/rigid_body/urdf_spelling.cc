// SPDX-License-Identifier: BSD-3-Clause
#include "urdf_spelling.h"

#include <algorithm>
#include <utility>

#include "contact_flow/nearest_name.h"

namespace contact_flow {
namespace {

using WordList = std::vector<std::string>;

/// What an element may hold: what is read, and what other programs read and this one passes over.
struct Vocabulary {
  const char* element;
  WordList tags, attributes, other_tags, other_attributes;
};

const std::vector<Vocabulary>& Vocabularies() {
  static const std::vector<Vocabulary> all = {
      {"link",
       {"inertial", "collision", "visual"},
       {"name"},
       {"material", "contact", "gazebo", "sensor", "transmission", "verbose", "bullet", "gravity",
        "kinematic", "surface", "self_filter", "self_collision_checking", "collision_checking",
        "audio_source", "sdf"},
       {"type", "concave"}},
      {"joint",
       {"parent", "child", "origin", "axis", "limit", "dynamics", "mimic"},
       {"name", "type"},
       {"calibration", "safety_controller", "gazebo", "transmission", "sensor", "material",
        "joint_properties", "controller_gains", "traits", "hardwareInterface", "verbose"},
       {"dont_collapse"}},
      {"inertial", {"origin", "mass", "inertia"}, {}, {"verbose"}, {"name"}},
      {"collision",
       {"origin", "geometry"},
       {"name"},
       {"material", "contact", "surface", "verbose", "max_contacts", "contact_coefficients"},
       {"concave", "group", "mask"}},
      {"geometry", {"box", "sphere", "cylinder", "capsule", "mesh"}, {}, {"verbose"}, {"name"}},
      {"origin", {}, {"xyz", "rpy"}, {}, {}},
      {"mass", {}, {"value"}, {}, {}},
      {"inertia",
       {},
       {"ixx", "ixy", "ixz", "iyy", "iyz", "izz"},
       {},
       {"iyx", "izx", "izy"}},  // the same again
      {"box", {}, {"size"}, {}, {}},
      {"sphere", {}, {"radius"}, {}, {}},
      {"cylinder", {}, {"radius", "length"}, {}, {}},
      {"capsule", {}, {"radius", "length"}, {}, {}},
      {"mesh", {}, {"filename", "scale"}, {}, {"name"}},
      {"parent", {}, {"link"}, {}, {}},
      {"child", {}, {"link"}, {}, {}},
      {"axis", {}, {"xyz"}, {}, {"rpy"}},
      {"limit",
       {},
       {"lower", "upper", "effort", "velocity"},
       {},
       {"acceleration", "deceleration", "jerk", "command_effort", "current", "gear_velocity",
        "k_velocity", "k_position"}},
      {"dynamics",
       {},
       {"damping", "friction"},
       {},
       {"armature", "D", "K", "mu_coulomb", "mu_viscous", "spring_reference", "spring_stiffness",
        "stiffness"}},
      {"mimic", {}, {"joint", "multiplier", "offset"}, {}, {}},
  };
  return all;
}

const Vocabulary* VocabularyOf(const std::string& element) {
  for (const Vocabulary& words : Vocabularies()) {
    if (words.element == element) return &words;
  }
  return nullptr;
}

bool HoldsWord(const WordList& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// WordList of other programs: drake:acceleration, xmlns:xacro.
bool IsForeignName(const std::string& name) { return name.find(':') != std::string::npos; }

/// "unknown tag …", or where a tag that is known elsewhere belongs.
std::string JudgedTag(const std::string& tag, const Vocabulary& words) {
  std::string homes;
  for (const Vocabulary& other : Vocabularies()) {
    if (!HoldsWord(other.tags, tag)) continue;
    homes += (homes.empty() ? "<" : ", <") + std::string(other.element) + ">";
  }
  if (!homes.empty()) return "<" + tag + "> is read within " + homes + " alone";
  return UnknownName("tag", tag, words.tags);
}

class Proofreader {
 public:
  /// Judges what `element`, a link or joint called `owner` or a part of it, holds.
  void Read(const XmlElement& element, const std::string& owner) {
    const Vocabulary* words = VocabularyOf(element.name);
    if (words == nullptr) return;
    const bool own = element.name == "link" || element.name == "joint";
    const std::string in = own ? "" : "<" + element.name + ">: ";
    for (const auto& attribute : element.attributes) {
      const std::string& name = attribute.first;
      if (IsForeignName(name) || name == "xmlns" || HoldsWord(words->attributes, name) ||
          HoldsWord(words->other_attributes, name)) {
        continue;
      }
      Tell(owner, element, in + UnknownName("attribute", name, words->attributes));
    }
    for (std::size_t k = 0; k < element.children.size(); ++k) {
      const XmlElement& part = element.children[k];
      if (HoldsWord(words->tags, part.name)) {
        if (part.name != "visual") Read(part, owner);
        continue;
      }
      const bool told = element.name == "geometry" && k == 0;  // as a shape that is none
      if (told || IsForeignName(part.name) || HoldsWord(words->other_tags, part.name)) continue;
      Tell(owner, part,
           in + (words->tags.empty() ? "unknown tag " + QuoteName(part.name)
                                     : JudgedTag(part.name, *words)));
    }
  }

  /// Judges an element beside links and joints, where it is nearly called as they are.
  void ReadBeside(const XmlElement& element) {
    for (const char* meant : {"link", "joint"}) {
      if (!IsMisspelt(element.name, meant, 1)) continue;
      Tell("robot", element, UnknownName("tag", element.name, {meant}));
    }
  }

  std::vector<std::string> Findings() const {
    std::vector<std::string> told;
    for (const Kind& kind : kinds_) {
      told.push_back(kind.first);
      if (kind.more > 0)
        told.back() += "; the same in " + std::to_string(kind.more) + " more places";
    }
    return told;
  }

 private:
  struct Kind {
    std::string what, first;
    int more;
  };

  void Tell(const std::string& owner, const XmlElement& at, const std::string& what) {
    for (Kind& kind : kinds_) {
      if (kind.what != what) continue;
      ++kind.more;
      return;
    }
    kinds_.push_back({what, owner + ": " + what + AtLine(at), 0});
  }

  std::vector<Kind> kinds_;
};

}  // namespace

std::vector<std::string> FindUnknownNames(const XmlElement& root) {
  Proofreader reader;
  for (const XmlElement& part : root.children) {
    if (part.name == "link" || part.name == "joint") {
      reader.Read(part, part.name + " '" + part.Attribute("name") + "'");
    } else {
      reader.ReadBeside(part);
    }
  }
  return reader.Findings();
}

}  // namespace contact_flow
