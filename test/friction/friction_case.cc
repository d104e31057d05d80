// SPDX-License-Identifier: BSD-3-Clause
#include "test/friction/friction_case.h"

#include "test/friction/systems/ball.h"
#include "test/friction/systems/block.h"
#include "test/friction/systems/compass_walker.h"
#include "test/friction/systems/puck.h"
#include "test/friction/systems/rod.h"
#include "test/friction/systems/soft_biped_with_friction.h"
#include "test/friction/systems/tip.h"
#include "test/friction/systems/tips.h"
#include "test/friction/systems/two_pucks.h"

namespace contact_flow {
namespace test {

std::unique_ptr<MechanicalSystem> MakeFrictionSystem(const nlohmann::json& json) {
  ParameterValues values;
  for (const auto& [name, value] : json["parameters"].items()) {
    const std::string letter = name == "mass_matrix" ? "m"
                               : name == "force"     ? "f"
                               : name == "stiffness" ? "k"
                                                     : name;
    if (value.is_array()) {
      for (std::size_t i = 0; i < value.size(); ++i) values[letter + std::to_string(i)] = value[i];
    } else {
      values[name] = value;
    }
  }
  const auto contact = [&](const char* key, const char* prefix) {
    const nlohmann::json list =
        json[key].is_array() ? json[key] : nlohmann::json::array({json[key]});
    for (std::size_t i = 0; i < list.size(); ++i) {
      values[prefix + std::to_string(i)] = list[i].is_string() ? -1.0 : list[i].get<double>();
    }
    // Of a refusal: one number for all.
    if (!json[key].is_array())
      values[std::string(prefix) + "1"] = values[std::string(prefix) + "0"];
  };
  contact("friction", "mu");
  contact("restitution", "gamma");
  const std::string model = json["model"];
  const bool plane =
      json["parameters"].contains("force") && json["parameters"]["force"].size() == 2;
  if (model == "block") return MakeSystem<Block>(values);
  if (model == "tip" && plane) return MakeSystem<Tip<2>>(values);
  if (model == "tip") return MakeSystem<Tip<3>>(values);
  if (model == "pair") return MakeSystem<Pair>(values);
  if (model == "tips") return MakeSystem<Tips<3>>(values);
  if (model == "rod") return MakeSystem<Rod>(values);
  if (model == "soft_biped") return MakeSystem<SoftBipedWithFriction>(values);
  if (model == "puck") return MakeSystem<Puck>(values);
  if (model == "ball") return MakeSystem<Ball>(values);
  if (model == "two_pucks") return MakeSystem<TwoPucks>(values);
  if (model == "compass_walker") return MakeSystem<CompassWalker>(values);
  throw std::runtime_error("no friction model " + model);
}

FrictionCase::FrictionCase(const std::string& name) {
  std::ifstream file(std::string(CONTACT_FLOW_TEST_DATA) + "/friction/" + name + ".json");
  if (!file) throw std::runtime_error("no friction case " + name);
  const nlohmann::json json = nlohmann::json::parse(file);
  system = MakeFrictionSystem(json);
  x = ToState(json["initial_state"]);
  u = system->nominal().u;
  duration = json["horizon"];
  final_state = ToState(json["final_state"]);
  event_times = ToVector(json["event_times"]);
  words = json["mode_words"].get<std::vector<std::string>>();
  for (const nlohmann::json& event : json["impulses"]) {
    std::vector<double> all;
    for (const nlohmann::json& contact : event) {
      for (double p : contact) all.push_back(p);
    }
    impulses.push_back(Eigen::Map<const Vector>(all.data(), static_cast<Eigen::Index>(all.size())));
  }
  energy_changes = json["energy_change_at_impacts"].get<std::vector<double>>();
  if (!json.contains("directional_derivatives")) return;
  for (const nlohmann::json& entry : json["directional_derivatives"]) {
    derivatives.push_back({ToVector(entry["direction"]), ToVector(entry["derivative"]),
                           entry["mode_words"].get<std::vector<std::string>>()});
  }
  for (const nlohmann::json& entry : json["parameter_derivatives"]) {
    int index = 0;
    for (std::size_t i = 0; i < system->description().constraints.size(); ++i) {
      if (system->description().constraints[i] == entry["constraint"]) index = static_cast<int>(i);
    }
    by_parameters.push_back(
        {(entry["parameter"] == "friction" ? "mu" : "gamma") + std::to_string(index),
         entry["sign"].get<double>(), ToVector(entry["derivative"])});
  }
}

std::vector<std::string> FrictionCaseNames() {
  return {"ball_slides_then_rolls",
          "border_bounce",
          "border_plastic",
          "border_plastic_slip",
          "border_stop",
          "bounce_beside_stop",
          "bouncing_point",
          "compass_walker",
          "double_stop",
          "falling_rod",
          "forced_stick_slip",
          "incline_stop",
          "land_while_stopping",
          "landing_beside_reversal",
          "landing_beside_stop",
          "landing_moves_sticking",
          "landing_moves_sticking_later",
          "landings_of_five_pieces",
          "noslip_biped",
          "noslip_double_release",
          "noslip_let_go_by_slip",
          "noslip_lifted_by_landing",
          "noslip_liftoff",
          "noslip_two_feet",
          "onset_beside_stops",
          "order_first",
          "order_second",
          "order_together",
          "puck_curve",
          "release_beside_landing",
          "slip_reversal",
          "soft_biped_friction",
          "spinning_ball",
          "stops_beside_release",
          "tip_in_space",
          "two_pucks"};
}

}  // namespace test
}  // namespace contact_flow
