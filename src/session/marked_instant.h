// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "asked.h"
#include "contact_flow/derivative/rolling_derivative.h"
#include "contact_flow/flow/online_flow.h"
#include "directions.h"
#include "setup.h"

namespace contact_flow {

/// The rolling derivative at one instant.
struct MarkReading {
  double t_mark = 0;               ///< where it begins [s]
  std::vector<std::string> names;  ///< of the directions [m]
  Matrix directions;               ///< at the mark, (δq, δv, δu, δp) [2d+k × m]
  RollingDerivative::Reading now;  ///< of its own t [s]
};

/// A marked instant of an online run, and the rolling derivative from there on. A function of the
/// run and of what was asked alone, so that verify_bag can repeat it.
class MarkedInstant {
 public:
  /// Marks flow->now(). Throws std::invalid_argument for directions that are none, or that the
  /// present contact mode does not admit. `setup` must outlive this.
  MarkedInstant(const Setup& setup, OnlineFlow* flow, const AskedMark& asked);

  const Directions& directions() const { return directions_; }
  /// After every AdvanceTo of the flow, with what it returned.
  void Follow(OnlineFlow* flow, bool passed) { rolling_->Follow(flow, passed); }
  /// Of now.
  MarkReading Read(OnlineFlow* flow);

 private:
  Directions directions_;
  std::unique_ptr<RollingDerivative> rolling_;
};

}  // namespace contact_flow
