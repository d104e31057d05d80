// SPDX-License-Identifier: BSD-3-Clause
#include "contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "contact_flow/io/map_reader.h"
#include "contact_flow/model/rigid_body/kinematics.h"
#include "robot_parts.h"

namespace contact_flow {
namespace {

constexpr double kFeetWithin = 0.1;  // of the robot's height

/// The hulls of a robot's bodies that move.
using Hulls = std::map<int, ContactHull>;

std::string Short(double number) {
  std::ostringstream text;
  text.precision(3);
  text << number;
  return text.str();
}

/// Numbers that a person can read: to 1e-9.
YAML::Node Vector3(const Vec3<double>& vector) {
  YAML::Node list;
  for (int k = 0; k < 3; ++k) {
    std::ostringstream text;
    text.precision(9);
    text << (std::abs(vector(k)) < 5e-10 ? 0. : vector(k));
    list.push_back(text.str());
  }
  list.SetStyle(YAML::EmitterStyle::Flow);
  return list;
}

bool IsNamed(const ContactOptions& options, const std::string& link) {
  return std::find(options.links.begin(), options.links.end(), link) != options.links.end();
}

/// Vertices of a mesh, or none with a warning.
const std::vector<Vec3<double>>& VerticesOf(const RobotModel::Shape& shape, const std::string& link,
                                            bool asked, ContactMeshes* meshes, MadeContacts* made) {
  const ContactMeshes::Mesh& mesh = meshes->Take(shape.mesh);
  if (mesh.wrong.empty()) return mesh.vertices;
  const std::string wrong =
      "link '" + link + "' (line " + std::to_string(shape.line) + " of the URDF): " + mesh.wrong;
  if (asked) {
    throw std::invalid_argument("contacts: " + wrong +
                                "; else take the link out of contacts/ground");
  }
  made->warnings.push_back(wrong + "; this shape makes no contacts");
  return mesh.vertices;
}

/// The points of every body that may be asked for.
Hulls AllHulls(const RobotModel& model, const ContactOptions& options, ContactMeshes* meshes,
               MadeContacts* made) {
  Hulls hulls;
  for (const RobotModel::Shape& shape : model.shapes) {
    const RobotModel::Link& link = model.links[shape.link];
    const bool named = IsNamed(options, link.name);
    if (link.body < 0 || (!options.all && !options.feet && !named)) continue;
    std::vector<Vec3<double>> vertices;
    if (shape.kind == RobotModel::Shape::Kind::kMesh) {
      vertices = VerticesOf(shape, link.name, named, meshes, made);
    }
    const ContactHull points = ShapePoints(model, shape, vertices);
    ContactHull* hull = &hulls[link.body];
    hull->points.insert(hull->points.end(), points.points.begin(), points.points.end());
    hull->error = std::max(hull->error, points.error);
  }
  return hulls;
}

/// Lowest and highest point of a body in the world [m].
std::pair<double, double> Extent(const RobotModel& model, const TreeState<double>& state,
                                 const ContactHull& hull) {
  std::pair<double, double> extent(HUGE_VAL, -HUGE_VAL);
  for (const ContactPoint& point : hull.points) {
    const RobotModel::Link& link = model.links[point.link];
    const Vec3<double> at = PointPosition(state, link.body, Vec3<double>(link.pose * point.point));
    double radius = point.radius;
    if (point.rim) {
      const Vec3<double> tip = PointPosition(
          state, link.body, Vec3<double>(link.pose * Vec3<double>(point.point + point.axis)));
      const double along = (tip - at)(2);
      radius *= std::sqrt(std::max(0., 1 - along * along));
    }
    extent.first = std::min(extent.first, at(2) - radius);
    extent.second = std::max(extent.second, at(2) + radius);
  }
  return extent;
}

/// Takes out what lies inside a sphere of the same body: it never touches first; and of corners
/// that are the same, as triangles of a mesh share them, all but one.
void DropHidden(const RobotModel& model, ContactHull* hull) {
  std::vector<Vec3<double>> places;
  std::vector<std::size_t> round;
  for (std::size_t i = 0; i < hull->points.size(); ++i) {
    const ContactPoint& point = hull->points[i];
    places.push_back(model.links[point.link].pose * point.point);
    if (point.radius > 0 && !point.rim) round.push_back(i);
  }
  std::set<std::array<double, 3>> corners;
  std::vector<ContactPoint> seen;
  for (std::size_t i = 0; i < hull->points.size(); ++i) {
    const ContactPoint& point = hull->points[i];
    bool hidden = false;
    for (const std::size_t k : round) {
      if (k == i || hidden) continue;
      const double inside = hull->points[k].radius - (places[i] - places[k]).norm() - point.radius;
      hidden = inside > 0 || (inside == 0 && k < i);  // of two that are the same one stays
    }
    if (!hidden && point.radius == 0) {
      hidden = !corners.insert({places[i](0), places[i](1), places[i](2)}).second;
    }
    if (!hidden) seen.push_back(point);
  }
  hull->points = seen;
}

/// Takes out all but the feet, and of these what is not low.
void KeepFeet(const RobotModel& model, const TreeState<double>& state, Hulls* hulls) {
  const auto& bodies = model.tree.bodies();
  std::set<int> carriers;
  double low = HUGE_VAL, bottom = HUGE_VAL, high = -HUGE_VAL;
  std::map<int, double> lowest;
  for (const auto& entry : *hulls) {
    for (int i = bodies[entry.first].parent; i >= 0; i = bodies[i].parent) carriers.insert(i);
    const auto extent = Extent(model, state, entry.second);
    lowest[entry.first] = extent.first;
    bottom = std::min(bottom, extent.first);
    high = std::max(high, extent.second);
  }
  for (const auto& entry : lowest) {
    if (carriers.count(entry.first) == 0) low = std::min(low, entry.second);
  }
  const double reach = low + kFeetWithin * (high - bottom);
  for (auto it = hulls->begin(); it != hulls->end();) {
    const bool end = carriers.count(it->first) == 0;
    const bool foot = end && lowest[it->first] <= reach;
    if (!foot) {
      it = hulls->erase(it);
      continue;
    }
    std::vector<ContactPoint> soles;
    for (const ContactPoint& point : it->second.points) {
      ContactHull one;
      one.points = {point};
      if (Extent(model, state, one).first <= reach) soles.push_back(point);
    }
    it->second.points = soles;
    ++it;
  }
}

/// Rims are kept; of the rest the best `most` points. Told where that changes anything.
ContactHull Reduced(const RobotModel& model, const ContactHull& hull, const ContactOptions& options,
                    MadeContacts* made) {
  if (hull.points.size() <= static_cast<std::size_t>(options.vertices) && hull.error == 0) {
    return hull;
  }
  ContactHull rims, rest, result;
  for (const ContactPoint& point : hull.points) {
    (point.rim ? rims : rest).points.push_back(point);
  }
  result = rest;
  if (static_cast<long>(rest.points.size()) > options.vertices) {
    const long left = options.vertices - static_cast<long>(rims.points.size());
    result = Thin(model, rest, static_cast<int>(std::max(1l, left)), options.tolerance);
  }
  result.error += hull.error;
  if (!result.points.empty()) {
    made->warnings.push_back("link '" + model.links[result.points[0].link].name +
                             "': " + std::to_string(result.points.size()) +
                             " contacts stand for its collision geometry, which " +
                             "they lie inside of by up to " + Short(result.error) + " m");
  }
  result.points.insert(result.points.end(), rims.points.begin(), rims.points.end());
  return result;
}

/// The constraint of a point with a surface of the terrain; null: with the plane z = height. What
/// the surface says itself goes before the options. Its nodes are shared, and never written to.
YAML::Node ToYaml(const RobotModel& model, const ContactPoint& point, const ContactOptions& options,
                  const YAML::Node& surface) {
  const std::string& link = model.links[point.link].name;
  const std::string kind = surface.IsMap() ? surface["kind"].Scalar() : "plane";
  if (kind != "plane" && point.radius != 0) {
    throw std::invalid_argument("terrain: link '" + link + "' is round, and the distance of a " +
                                "sphere or wheel to a height field has no formula: write "
                                "constraints for points of it");
  }
  YAML::Node map;
  map["kind"] = point.rim ? "rim" : kind;
  if (surface.IsMap()) {
    for (const auto& entry : surface) {
      const std::string key = entry.first.Scalar();
      if (key != "kind") map[key] = entry.second;
    }
  } else if (options.height != 0) {
    map["offset"] = options.height;
  }
  map["link"] = link;
  if (!point.point.isZero(5e-10)) map["point"] = Vector3(point.point);
  if (point.rim) map["axis"] = Vector3(point.axis);
  if (point.radius != 0) map["radius"] = point.radius;
  if (options.restitution != 0 && !map["restitution"]) map["restitution"] = options.restitution;
  if (options.friction.IsDefined() && !options.friction.IsNull() && !map["friction"]) {
    map["friction"] = YAML::Clone(options.friction);
  }
  map.SetStyle(YAML::EmitterStyle::Flow);
  return map;
}

/// Names of surfaces; one without a name for the plane z = height.
std::vector<std::pair<std::string, YAML::Node>> Surfaces(const ContactOptions& options) {
  if (!options.terrain.IsDefined() || !options.terrain.IsMap()) return {{"", YAML::Node()}};
  std::vector<std::pair<std::string, YAML::Node>> surfaces;
  for (const auto& entry : options.terrain) {
    surfaces.emplace_back("_" + entry.first.Scalar(), entry.second);
  }
  return surfaces;
}

}  // namespace

ContactOptions ReadContactOptions(const YAML::Node& map, const RobotModel& model) {
  MapReader reader(map, "contacts");
  ContactOptions options;
  options.line = reader.Line("ground");
  std::vector<std::string> ground;
  reader.Require("ground");
  reader.Read("ground", &ground);
  if (ground.empty()) {
    throw std::invalid_argument("contacts/ground is an empty list" + options.line +
                                "; expected feet, all, none, or links with collision geometry");
  }
  options.feet = ground == std::vector<std::string>{"feet"};
  options.all = ground == std::vector<std::string>{"all"};
  if (!options.feet && !options.all && ground != std::vector<std::string>{"none"}) {
    for (const std::string& name : ground) {
      try {
        const int link = static_cast<int>(&model.FindLink(name) - model.links.data());
        const auto shapes = std::count_if(model.shapes.begin(), model.shapes.end(),
                                          [&](const auto& shape) { return shape.link == link; });
        if (shapes > 0) continue;
        const std::string sole = name + "_sole";
        if (std::any_of(model.links.begin(), model.links.end(),
                        [&sole](const auto& other) { return other.name == sole; })) {
          throw std::invalid_argument("link '" + name + "' has a sole, to which its <collision> " +
                                      "went: write '" + sole + "'");
        }
        throw std::invalid_argument("link '" + name + "' has no <collision> in the URDF");
      } catch (const std::invalid_argument& error) {
        throw std::invalid_argument("contacts/ground: " + std::string(error.what()) + options.line +
                                    "; expected feet, all, none, or links with collision geometry");
      }
    }
    options.links = ground;
  }
  reader.Read("height", &options.height);
  reader.Read("restitution", &options.restitution);
  if (!(options.restitution >= 0 && options.restitution <= 1)) {
    throw std::invalid_argument("contacts/restitution is " + Short(options.restitution) +
                                ", expected 0 to 1" + reader.Line("restitution"));
  }
  options.friction = reader.Child("friction");
  if (reader.Has("friction")) ReadFriction("contacts", &reader);
  reader.Read("vertices", &options.vertices, 1, 64);
  reader.Read("tolerance", &options.tolerance);
  if (!(options.tolerance >= 0)) {
    throw std::invalid_argument("contacts/tolerance is negative" + reader.Line("tolerance"));
  }
  reader.Finish();
  return options;
}

MadeContacts MakeContacts(const RobotModel& model, const Vector& q, const ContactOptions& options,
                          ContactMeshes* meshes) {
  MadeContacts made;
  made.constraints = YAML::Node(YAML::NodeType::Map);
  TreeState<double> state(model.tree);
  UpdatePositions(model.tree, q.data(), &state);
  for (const std::string& name : options.links) {
    if (model.FindLink(name).body >= 0) continue;
    made.warnings.push_back("contacts/ground: link '" + name + "' does not move, and makes none" +
                            options.line);
  }
  Hulls hulls = AllHulls(model, options, meshes, &made);
  for (auto& entry : hulls) DropHidden(model, &entry.second);
  if (options.feet) KeepFeet(model, state, &hulls);
  made.lowest = HUGE_VAL;
  std::map<std::string, std::vector<ContactPoint>> of_link;
  std::vector<std::string> order;
  for (const auto& entry : hulls) {
    const ContactHull hull = Reduced(model, entry.second, options, &made);
    if (hull.points.empty()) continue;
    made.lowest = std::min(made.lowest, Extent(model, state, hull).first - options.height);
    for (const ContactPoint& point : hull.points) {
      const std::string& link = model.links[point.link].name;
      if (of_link[link].empty()) order.push_back(link);
      of_link[link].push_back(point);
      ++made.count;
    }
  }
  const auto surfaces = Surfaces(options);
  made.count *= static_cast<int>(surfaces.size());
  bool friction = options.friction.IsDefined() && !options.friction.IsNull();
  for (const auto& surface : surfaces) friction = friction || surface.second["friction"];
  const int most =
      friction ? options.most / 3 : options.most;  // by its guards, of which it has three
  if (made.count > most) {
    throw std::invalid_argument("contacts: " + std::to_string(made.count) + " contacts" +
                                (friction ? " with friction" : "") + ", at most " +
                                std::to_string(most) + " are possible" + options.line +
                                ": name fewer links, or fewer vertices");
  }
  for (const std::string& link : order) {
    const std::vector<ContactPoint>& points = of_link[link];
    for (std::size_t k = 0; k < points.size(); ++k) {
      const std::string name = points.size() == 1 ? link : link + "_" + std::to_string(k + 1);
      for (const auto& surface : surfaces) {
        made.constraints[name + surface.first] = ToYaml(model, points[k], options, surface.second);
      }
    }
  }
  return made;
}

}  // namespace contact_flow
