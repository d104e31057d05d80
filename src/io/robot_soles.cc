// SPDX-License-Identifier: BSD-3-Clause
#include <stdexcept>

#include "robot_parts.h"

namespace contact_flow {
namespace {

double Positive(MapReader* reader, const std::string& name, const std::string& key) {
  double value = 0;
  reader->Require(key);
  reader->Read(key, &value);
  if (!(value > 0)) {
    throw std::invalid_argument("soles/" + name + "/" + key + " is not positive" +
                                reader->Line(key));
  }
  return value;
}

}  // namespace

YAML::Node AddSoles(const YAML::Node& map, RobotModel* model) {
  YAML::Node efforts(YAML::NodeType::Map);
  if (!map.IsDefined() || map.IsNull()) return efforts;
  ForEach(map, "soles", [&](const std::string& name, MapReader* reader) {
    const double stiffness = Positive(reader, name, "stiffness");
    const double mass = Positive(reader, name, "mass");
    double damping = 0;
    reader->Read("damping", &damping);
    if (!(damping >= 0)) {
      throw std::invalid_argument("soles/" + name + "/damping is negative" +
                                  reader->Line("damping"));
    }
    RobotModel::Link link;
    try {
      link = model->FindLink(name);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("soles: " + std::string(error.what()) + reader->Line(""));
    }
    const int foot = static_cast<int>(&model->FindLink(name) - model->links.data());
    const std::string sole = name + "_sole";
    RobotModel::Mount mount{link.body, link.pose};
    const char* const letters = "xyz";
    for (int k = 0; k < 3; ++k) {
      const std::string joint = sole + "_" + letters[k];
      mount = model->AddPrismatic(mount, joint, Vec3<double>::Unit(k));
      YAML::Node spring;
      spring["kind"] = "joint_spring";
      spring["joint"] = joint;
      spring["stiffness"] = stiffness;
      spring["damping"] = damping;
      spring.SetStyle(YAML::EmitterStyle::Flow);
      efforts[joint + "_spring"] = spring;
    }
    BodyInertia inertia;
    inertia.mass = mass;
    model->links.push_back({sole, mount.body, mount.pose, inertia});
    for (RobotModel::Shape& shape : model->shapes) {
      if (shape.link == foot) shape.link = static_cast<int>(model->links.size()) - 1;
    }
  });
  model->JoinInertias();
  model->CheckMass();
  return efforts;
}

void CheckSoledLinks(const YAML::Node& soles, const YAML::Node& constraints) {
  if (!soles.IsDefined() || !soles.IsMap() || !constraints.IsDefined() || !constraints.IsMap()) {
    return;
  }
  MapReader outer(constraints, "constraints");
  for (const std::string& name : outer.Keys()) {
    const YAML::Node map = outer.Child(name);
    for (const char* key : {"link", "other_link"}) {
      const YAML::Node link = map.IsMap() ? map[key] : YAML::Node(YAML::NodeType::Undefined);
      if (!link.IsDefined() || !link.IsScalar() || !soles[link.Scalar()]) continue;
      const std::string& foot = link.Scalar();
      throw std::invalid_argument("constraints/" + name + "/" + key + ": '" + foot +
                                  "' has a sole, which is what touches: write '" + foot +
                                  "_sole', whose frame is that of '" + foot + "'" +
                                  MapReader(map, "").Line(key));
    }
  }
}

}  // namespace contact_flow
