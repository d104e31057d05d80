// SPDX-License-Identifier: BSD-3-Clause
#include "scenario.h"

#include <yaml-cpp/yaml.h>

#include <limits>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace benchmark {
namespace {

enum Coordinate { kLeftFootX = 1, kLeftFootZ = 4, kRightFootZ = 5, kDof = 7 };

Vector Numbers(const YAML::Node& node) {
  const auto numbers = node.as<std::vector<double>>();
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

Vector State(const YAML::Node& node) {
  Vector x(kStates);
  x << Numbers(node["q"]), Numbers(node["v"]);
  return x;
}

/// A reference case; JSON is YAML.
Scenario Load(const std::string& file) {
  const YAML::Node root = YAML::LoadFile(CONTACT_FLOW_TEST_DATA "/" + file);
  Scenario scenario;
  ParameterValues parameters;
  for (const auto& parameter : root["parameters"]) {
    parameters[parameter.first.as<std::string>()] = parameter.second.as<double>();
  }
  scenario.system = MakeModel(root["model"].as<std::string>(), parameters);
  scenario.x = State(root["initial_state"]);
  scenario.u = Vector::Zero(0);
  scenario.duration = root["horizon"].as<double>();
  scenario.final_state = State(root["final_state"]);
  scenario.jacobian = Matrix::Constant(kStates, kStates, std::numeric_limits<double>::quiet_NaN());
  for (const YAML::Node& entry : root["directional_derivatives"]) {
    const Vector direction = Numbers(entry["direction"]);
    for (int k = 0; k < kStates; ++k) {
      if (direction == Vector::Unit(kStates, k)) {
        scenario.jacobian->col(k) = Numbers(entry["derivative"]);
      }
    }
  }
  return scenario;
}

}  // namespace

Scenario TiltedTrot() {
  Scenario scenario = Load("soft_biped_tilted.json");
  scenario.name = "A";
  scenario.about = "tilted trot, flight is free fall";
  return scenario;
}

Scenario OscillatingTrot() {
  Scenario scenario = Load("soft_biped_tilted.json");
  scenario.name = "B";
  scenario.about = "tilted trot, legs oscillate in flight";
  scenario.x(kLeftFootZ) -= 0.05;
  scenario.x(kRightFootZ) -= 0.03;
  scenario.x(kDof) = 0.1;  // body x rate
  scenario.x(kDof + kLeftFootX) = -0.2;
  scenario.x(kDof + kLeftFootX + 1) = 0.15;
  scenario.x(kDof + 6) = 0.2;  // pitch rate
  scenario.final_state.reset();
  scenario.jacobian.reset();
  return scenario;
}

Scenario SimultaneousTrot() {
  Scenario scenario = Load("soft_biped_simultaneous.json");
  scenario.name = "simultaneous";
  scenario.about = "both feet touch down at once";
  return scenario;
}

}  // namespace benchmark
}  // namespace contact_flow
