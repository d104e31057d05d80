// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <stdexcept>

#include "robot_parts.h"

namespace contact_flow {
namespace {

/// Whether something of the robot is held by nothing.
bool CanFall(const RobotModel& model) {
  for (const std::string& name : model.coordinates) {
    if (name == "base_z") return true;
  }
  for (const RigidBodyTree::Body& body : model.tree.bodies()) {
    if (body.joint == JointKind::kTranslation) return true;
  }
  return false;
}

/// The nominal positions as far as they can be read; wrong ones are told of where they are used.
Vector NominalPositions(const YAML::Node& document, const RobotModel& model,
                        const std::vector<std::string>& limited) {
  Vector q = model.tree.Neutral(), v = Vector::Zero(model.tree.dof());
  CentreLimited(limited, model, &q);
  const YAML::Node nominal = document["nominal"];
  if (!nominal.IsDefined() || !nominal.IsMap() || !nominal["positions"].IsDefined()) {
    Follow(YAML::Node(), YAML::Node(), model, &q, &v);
    return q;
  }
  const YAML::Node positions = nominal["positions"];
  for (std::size_t k = 0; positions.IsMap() && k < model.coordinates.size(); ++k) {
    const YAML::Node value = positions[model.coordinates[k]];
    double number = 0;
    if (value.IsDefined() && YAML::convert<double>::decode(value, number) &&
        std::isfinite(number)) {
      q(k) = number;
    }
  }
  Follow(positions, YAML::Node(), model, &q, &v);
  return q;
}

MadeContacts ReadMade(const YAML::Node& map) {
  MadeContacts made;
  MapReader reader(map, "contacts_made");
  made.constraints = reader.Child("constraints");
  made.count = made.constraints.IsMap() ? static_cast<int>(made.constraints.size()) : 0;
  reader.Read("lowest", &made.lowest);
  reader.Read("warnings", &made.warnings);
  reader.Finish();
  return made;
}

/// A plan without contacts: what that means, why, and what was said of its shapes.
MadeContacts NoContacts(const std::string& meaning, std::vector<std::string> shapes) {
  MadeContacts none;
  std::string why = "no collision geometry of the URDF could be used";
  if (!shapes.empty()) {
    why += ": " + shapes[0];
    if (shapes.size() > 1) why += "; and " + std::to_string(shapes.size() - 1) + " more below";
    shapes.erase(shapes.begin());
  }
  none.warnings.push_back("NO CONTACTS: " + meaning + ": " + why);
  none.warnings.insert(none.warnings.end(), shapes.begin(), shapes.end());
  return none;
}

const char kFalls[] = "this robot falls through everything";
/// Contacts that are made though nobody asks for them.
constexpr int kMostUnasked = 128;

/// The contacts that a map `contacts` asks for.
MadeContacts AskedContacts(const YAML::Node& document, const RobotModel& model, const Vector& q,
                           const YAML::Node& terrain, ContactMeshes* meshes) {
  ContactOptions options = ReadContactOptions(document["contacts"], model);
  options.terrain = terrain;
  if (terrain.IsMap() && options.height != 0) {
    throw std::invalid_argument(
        "contacts/height is given beside a terrain, whose surfaces say themselves where they are: "
        "take one of them out" +
        MapReader(document["contacts"], "contacts").Line("height"));
  }
  const MadeContacts made = MakeContacts(model, q, options, meshes);
  const bool asked = options.feet || options.all || !options.links.empty();
  if (made.count > 0 || !asked) return made;
  const bool falls = CanFall(model) && !document["constraints"];
  return NoContacts(falls ? kFalls : "contacts/ground makes none" + options.line, made.warnings);
}

/// All contacts, with fewer points where there are too many, or else the feet.
MadeContacts UsualContacts(const RobotModel& model, const Vector& q, const YAML::Node& terrain,
                           ContactMeshes* meshes) {
  const struct {
    bool feet;
    long vertices;
  } ways[] = {{false, 16}, {false, 8}, {true, 16}, {true, 8}, {true, 4}};
  std::string refusal;
  for (const auto& way : ways) {
    ContactOptions options;
    options.feet = way.feet;
    options.all = !way.feet;
    options.vertices = way.vertices;
    options.terrain = terrain;
    options.most = kMostUnasked;
    try {
      MadeContacts made = MakeContacts(model, q, options, meshes);
      if (made.count == 0) {
        made = NoContacts(kFalls, made.warnings);
        made.warnings[0] += "; or write `constraints`";
        return made;
      }
      made.warnings.push_back(
          std::string(terrain.IsMap() ? "`contacts` is not given: "
                                      : "neither `constraints` nor `contacts` is given: ") +
          std::to_string(made.count) + " contacts with the ground " +
          (terrain.IsMap() ? "" : "z = 0 ") + "were made from " +
          (way.feet ? "the collision geometry of the feet (of all links there were too many): what "
                      "else touches the ground passes through it"
                    : "all collision geometry") +
          "; describe_robot prints them");
      return made;
    } catch (const std::invalid_argument& error) {
      if (terrain.IsMap() && way.vertices == 4) throw;
      refusal = error.what();
    }
  }
  MadeContacts none;
  none.warnings.push_back(std::string("NO CONTACTS: ") + kFalls + ": " + refusal);
  return none;
}

}  // namespace

double ReadFriction(const std::string& map, MapReader* reader) {
  double coefficient = 0;
  reader->Read("friction", "no_slip", Friction::kNoSlip, &coefficient);
  if (coefficient >= 0) return coefficient;
  throw std::invalid_argument(map + "/friction is " + reader->Child("friction").Scalar() +
                              ", expected a number that is not negative, or no_slip" +
                              reader->Line("friction"));
}

MadeContacts PlanContacts(const YAML::Node& document, const std::string& folder,
                          const RobotModel& model, const std::vector<std::string>& limited) {
  if (document["contacts_made"]) return ReadMade(document["contacts_made"]);
  const Vector q = NominalPositions(document, model, limited);
  const YAML::Node terrain = ReadTerrain(document["terrain"], folder);
  ContactMeshes meshes(folder);
  if (document["contacts"]) return AskedContacts(document, model, q, terrain, &meshes);
  const bool asked = terrain.IsMap();
  if (!asked && (document["constraints"] || !CanFall(model))) return MadeContacts();
  return UsualContacts(model, q, terrain, &meshes);
}

}  // namespace contact_flow
