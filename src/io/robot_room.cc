// SPDX-License-Identifier: BSD-3-Clause
// Whether a robot's constraints have room in sets of constraints, in which Guards puts them.
#include <map>
#include <stdexcept>

#include "robot_parts.h"

namespace contact_flow {
namespace {

constexpr int kMostGuards = ConstraintSet::kMaxConstraints;
/// Contacts of one body without friction that are dependent, in the plane.
constexpr int kMayShare = 3;

std::string LineOf(const YAML::Node& node) {
  if (!node.IsDefined() || node.Mark().is_null()) return "";
  return " (line " + std::to_string(node.Mark().line + 1) + ")";
}

/// "8 of `constraints` (line 3)", and so on, of what there is.
std::string ListParts(const ConstraintCounts& counts, const YAML::Node& document, int written) {
  std::string list;
  const auto add = [&](int count, const char* of, const YAML::Node& node) {
    if (count == 0) return;
    list += (list.empty() ? "" : ", ") + std::to_string(count) + " " + of + LineOf(node);
  };
  const YAML::Node joints = document["joints"];
  const auto of_joints = [&](const char* key) {
    return joints.IsDefined() && joints.IsMap() ? joints[key]
                                                : YAML::Node(YAML::NodeType::Undefined);
  };
  const bool asked = document["contacts"].IsDefined();
  add(written, "of `constraints`", document["constraints"]);
  add(counts.contacts, asked ? "of `contacts`" : "made from collision geometry",
      document["contacts"]);
  add(counts.stops, "stops of `joints/limits`", of_joints("limits"));
  add(counts.brakes, "of `joints/friction`", of_joints("friction"));
  add(counts.switches, "switches of linear references of `efforts`", document["efforts"]);
  return list;
}

std::string Remedy(const ConstraintCounts& counts, int written, bool friction) {
  std::string remedy;
  const auto add = [&](bool there, const char* what) {
    if (there) remedy += (remedy.empty() ? "" : ", ") + std::string(what);
  };
  add(counts.contacts > 0, "name fewer links, or fewer `vertices`, in `contacts`");
  add(counts.stops > 0 || counts.brakes > 0, "list the joints that need them in `joints`");
  add(counts.switches > 0, "take references of kind cubic or blended, which have no switches");
  add(written > 0, "leave out `constraints` that are not needed");
  add(friction, "leave out friction where nothing slips or sticks");
  return remedy;
}

}  // namespace

void CheckRoom(const ConstraintCounts& counts, const YAML::Node& document,
               RobotDescription* robot) {
  const int all = static_cast<int>(robot->constraints.size());
  int friction = 0;
  std::map<int, int> slippery;  // contacts without friction, by body
  for (const auto& element : robot->constraints) {
    if (element->slip.rows > 0) {
      ++friction;
    } else if (element->Touches() && !element->parts.points.empty()) {
      ++slippery[element->parts.points[0].body];
    }
  }
  const int written = all - counts.contacts - counts.stops - counts.brakes - counts.switches;
  const int guards = all + 2 * friction;
  if (guards > kMostGuards) {
    const std::string most = std::to_string(kMostGuards);
    throw std::invalid_argument(
        std::to_string(all) + " constraints (" + ListParts(counts, document, written) + ")" +
        (friction == 0 ? ", at most " + most + " are possible"
                       : ", of which " + std::to_string(friction) +
                             " have friction: constraints and twice those with friction, " +
                             std::to_string(guards) + ", may be " + most + " at most") +
        ": " + Remedy(counts, written, friction > 0));
  }
  if (friction == 0 || 3 * all <= kMostGuards) return;
  for (const auto& [body, count] : slippery) {
    if (count < kMayShare) continue;
    robot->model.warnings.push_back(
        std::to_string(count) + " contacts of one body are without friction, beside " +
        std::to_string(friction) + " with friction among " + std::to_string(all) +
        " constraints: a run in which they share forces, as on one floor, ends, as that takes at "
        "most " +
        std::to_string(kMostGuards / 3) + " constraints; give one of them `friction: 0`");
    return;
  }
}

}  // namespace contact_flow
