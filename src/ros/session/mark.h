// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "contact_flow/RollingTangents.h"
#include "contact_flow/SimulatorMark.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "src/ros/request/directions.h"
#include "src/ros/request/setup.h"

namespace contact_flow {
namespace ros_interface {

/// A marked instant of an online run, and the rolling derivative from there on. A function of the
/// run and of what was asked alone, so that verify_bag can repeat it.
class MarkedInstant {
 public:
  /// Marks flow->now(). Throws std::invalid_argument for directions that are none, or that the
  /// present contact mode does not admit. `setup` must outlive this.
  MarkedInstant(const Setup& setup, OnlineFlow* flow, const SimulatorMark& asked);

  const Directions& directions() const { return directions_; }
  /// After every AdvanceTo of the flow, with what it returned.
  void Follow(OnlineFlow* flow, bool passed) { rolling_->Follow(flow, passed); }
  /// Now; header and epoch are left empty.
  RollingTangents Message(OnlineFlow* flow);

 private:
  const Setup& setup_;
  Directions directions_;
  std::unique_ptr<RollingDerivative> rolling_;
};

}  // namespace ros_interface
}  // namespace contact_flow
