// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "contact_flow/model/mechanical_system.h"
#include "test/reference_case.h"

namespace contact_flow {
namespace test {

/// A frictional run in quadruple precision.
struct FrictionCase {
  struct Derivative {
    Vector direction, derivative;
    std::vector<std::string> words;
  };
  struct ByParameter {
    std::string parameter;  ///< "mu0", "gamma1", …
    double sign;
    Vector derivative;
  };

  explicit FrictionCase(const std::string& name);

  std::unique_ptr<MechanicalSystem> system;
  Vector x, u, final_state, event_times;
  double duration = 0;
  std::vector<std::string> words;
  std::vector<Vector> impulses;  ///< (p_n, p_t…) contact by contact; empty where there is none
  std::vector<double> energy_changes;
  std::vector<Derivative> derivatives;
  std::vector<ByParameter> by_parameters;
};

/// The system of a case's "model", "parameters", "friction" and "restitution".
std::unique_ptr<MechanicalSystem> MakeFrictionSystem(const nlohmann::json& json);

std::vector<std::string> FrictionCaseNames();

}  // namespace test
}  // namespace contact_flow
