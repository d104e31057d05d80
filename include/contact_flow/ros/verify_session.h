// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "contact_flow/HybridState.h"
#include "contact_flow/ModelDescription.h"
#include "contact_flow/SimulatorEpoch.h"
#include "contact_flow/SimulatorEvent.h"
#include "contact_flow/SimulatorInput.h"
#include "contact_flow/flow/online_flow.h"
#include "contact_flow/ros/setup.h"

namespace contact_flow {
namespace ros_interface {

/// Repeats a recorded session from its epochs and inputs alone, message by message in the order they were recorded,
/// and compares events and states with what comes of it, bit for bit. Each call answers how the message differs, or "".
class SessionVerifier {
 public:
  std::string Take(const ModelDescription& model);
  /// Also compares where the epoch before has ended, and what can be computed of where this one begins.
  std::string Take(const SimulatorEpoch& epoch);
  std::string Take(const SimulatorInput& input);
  std::string Take(const SimulatorEvent& event);
  std::string Take(const HybridState& state);

 private:
  /// Goes on to t, or to the next event before or at it: then true.
  bool AdvanceTo(double t);
  /// The epoch a message must belong to; "" when it does.
  std::string Belongs(std::uint32_t epoch) const;

  std::optional<Configuration> configuration_;
  std::shared_ptr<const Setup> setup_;
  std::unique_ptr<OnlineFlow> flow_;
  std::unique_ptr<ContactDynamics> dynamics_;
  std::uint32_t epoch_ = 0;
  std::uint64_t events_ = 0;
  bool counting_ = false;  // events_ is known
};

}  // namespace ros_interface
}  // namespace contact_flow
