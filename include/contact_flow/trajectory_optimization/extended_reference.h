// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A part of a reference between two events of contacts.
struct ReferencePhase {
  ContactMode mode;       ///< J
  double t_begin = 0;     ///< [s]
  double t_end = 0;       ///< [s]
  Vector x_begin;         ///< right limit at its begin [nq+d]
  Vector x_end;           ///< left limit at its end [nq+d]
  ContactMode activated;  ///< what touches down at its end, …
  ContactMode released;   ///< … and what lets go
};

/// A run that is to be followed, each phase of which goes on beyond the events at its ends: forward
/// and backward in its own contact mode, under the inputs of the time, whether gaps or forces would
/// allow it. A robot whose touchdown comes early or late is compared with the phase that it is in,
/// and its error does not jump.
class ExtendedReference {
 public:
  /// Of a trajectory made with SimulateOptions::dense under these inputs; each phase goes on by at
  /// most `reach` [s] at either end. `system` must outlive this. Throws std::invalid_argument for a
  /// run that ended early and a reach that is not finite or below 0.
  ExtendedReference(const MechanicalSystem& system, Trajectory run, InputSchedule inputs,
                    double reach);

  const std::vector<ReferencePhase>& phases() const { return phases_; }  ///< in their order
  /// Index of the phase at t, the earlier one at an event.
  int PhaseAt(double t) const;
  /// x of a phase at t [nq+d]; where t is further away than `reach`, that at the reach.
  Vector State(int phase, double t) const;
  /// The input at t, which holds from there on [m].
  const Vector& Input(double t) const;
  const MechanicalSystem& system() const { return system_; }  ///< whose run it is
  const Trajectory& run() const { return run_; }              ///< itself
  const InputSchedule& inputs() const { return inputs_; }     ///< its inputs

 private:
  Vector Continued(const ReferencePhase& phase, Vector x, double from, double to) const;

  const MechanicalSystem& system_;
  Trajectory run_;
  InputSchedule inputs_;
  double reach_;
  std::vector<ReferencePhase> phases_;
};

}  // namespace contact_flow
