// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {
namespace benchmark {

/// Size of the trot's state (q, v).
inline constexpr int kStates = 14;

/// A run of the soft-leg trot, with what is known of its outcome beforehand.
struct Scenario {
  std::string name;
  std::string about;
  std::unique_ptr<MechanicalSystem> system;
  Vector x;                           ///< initial state [14]
  Vector u;                           ///< no input [0]
  double duration = 0;                ///< [s]
  std::optional<Vector> final_state;  ///< φ(T, x), from quadruple precision
  std::optional<Matrix> jacobian;     ///< Dφ(T, x), likewise
};

/// Flight is free fall, then one foot after the other.
Scenario TiltedTrot();
/// The same with legs off their rest length and moving: the springs oscillate in flight.
Scenario OscillatingTrot();
/// Both feet at once.
Scenario SimultaneousTrot();

}  // namespace benchmark
}  // namespace contact_flow
