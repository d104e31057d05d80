// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "contact_flow/model/model_library.h"

namespace contact_flow {
namespace test {

using Names = std::vector<std::vector<std::string>>;

inline Vector ToVector(const nlohmann::json& array) {
  Vector v(array.size());
  for (std::size_t i = 0; i < array.size(); ++i) v(i) = array[i].get<double>();
  return v;
}

inline Vector ToState(const nlohmann::json& state) {
  const Vector q = ToVector(state["q"]), v = ToVector(state["v"]);
  Vector x(q.size() + v.size());
  x << q, v;
  return x;
}

/// A run computed in quadruple precision by an independent program: states and times right to
/// 1e-25, directional derivatives (one-sided quotients, one Richardson step) to about 1e-11.
struct ReferenceCase {
  struct Derivative {
    Vector direction, derivative;
    Names modes;
  };

  explicit ReferenceCase(const std::string& name) {
    std::ifstream file(std::string(CONTACT_FLOW_TEST_DATA) + "/" + name + ".json");
    if (!file) throw std::runtime_error("no reference case " + name);
    const nlohmann::json json = nlohmann::json::parse(file);
    system = MakeModel(json["model"], json["parameters"].get<ParameterValues>());
    x = ToState(json["initial_state"]);
    u = system->nominal().u;
    duration = json["horizon"];
    final_state = ToState(json["final_state"]);
    event_times = ToVector(json["event_times"]);
    modes = json["mode_sequence"].get<Names>();
    if (!json.contains("directional_derivatives")) return;
    for (const nlohmann::json& entry : json["directional_derivatives"]) {
      derivatives.push_back({ToVector(entry["direction"]), ToVector(entry["derivative"]),
                             entry["mode_sequence"].get<Names>()});
    }
  }

  /// The largest entry of all derivatives of the case.
  double DerivativeScale() const {
    double scale = 0;
    for (const Derivative& d : derivatives) {
      scale = std::max(scale, d.derivative.cwiseAbs().maxCoeff());
    }
    return scale;
  }

  Names NamesOf(const std::vector<ContactMode>& sequence) const {
    Names names;
    for (ContactMode mode : sequence)
      names.push_back(mode.Names(system->description().constraints));
    return names;
  }

  std::unique_ptr<MechanicalSystem> system;
  Vector x, u, final_state, event_times;
  double duration = 0;
  Names modes;
  std::vector<Derivative> derivatives;
};

inline std::vector<std::string> ReferenceNames() {
  return {"ball_in_corner",
          "double_pendulum_simultaneous",
          "hopping_trot_stable",
          "hopping_trot_unstable",
          "rigid_biped_left_first",
          "rigid_biped_right_first",
          "rigid_biped_simultaneous",
          "soft_biped_decoupled",
          "soft_biped_simultaneous",
          "soft_biped_tilted",
          "wall_and_floor"};
}

}  // namespace test
}  // namespace contact_flow
