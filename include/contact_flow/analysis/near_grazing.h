// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Below which an event counts as near to one that no first order describes (Def. 3). A
/// perturbation of about this size then changes the sequence of events.
struct GrazingThresholds {
  double approach_speed = 1e-4;  ///< [m/s]; 100 times SimulateOptions::speed_tolerance
  double release_rate = 1e-4;    ///< [N/s]
  double gap = 1e-6;             ///< [m]; 1000 times SimulateOptions::gap_tolerance
  double force = 1e-4;           ///< [N]
};

/// One event of a run that nearly grazes.
struct GrazingEvent {
  /// What nearly happened.
  enum class Kind {
    kSlowTouchdown,  ///< a gap closes (a compliant one also: opens) with a small |Da_i v| [m/s]
    kSlowRelease,    ///< a force passes zero with a small |dλ_i/dt| [N/s]
    kNearTouchdown,  ///< a gap comes near to zero and opens again [m]
    kNearRelease,    ///< a force comes near to zero and grows again [N]
  };
  Kind kind = Kind::kSlowTouchdown;  ///< what nearly happened
  int constraint = -1;  ///< −1: not known, the run was made without SimulateOptions::dense
  double t = std::numeric_limits<double>::quiet_NaN();  ///< [s]; NaN: not known
  double value = 0;      ///< the speed, rate, gap or force that is small
  double threshold = 0;  ///< which it is below
};

/// "slow touchdown", …
const char* GrazingKindName(GrazingEvent::Kind kind);

/// The events of a run that nearly graze, in the order of these kinds, then of time. What the run's
/// Margins state as numbers gets constraint and time here; the dips of gaps and forces are searched
/// on the dense motion, and only if the margins are below their thresholds.
std::vector<GrazingEvent> FindNearGrazing(const MechanicalSystem& system,
                                          const Trajectory& trajectory,
                                          const GrazingThresholds& thresholds = {});

/// "near grazing: the gap of 'ceiling' comes to 2e-07 m at t = 0.4 s", for people.
std::string Describe(const SystemDescription& description, const GrazingEvent& event);

}  // namespace contact_flow
