// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "contact_flow/contact_mode.h"
#include "contact_flow/flow/input_schedule.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/configuration_space.h"
#include "contact_flow/model/mechanical_system.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// A part of a reference between two events of contacts. Its motion is a table that goes on beyond
/// both its ends; the event at its end has the left limit x_end here and as its right limit the
/// x_begin of the next phase. What comes by the time, as the knots of a linear reference that the
/// robot follows, is passed inside.
struct ReferencePhase {
  ContactMode mode;         ///< J, at its begin
  double t_begin = 0;       ///< [s]
  double t_end = 0;         ///< [s]
  Vector x_begin;           ///< right limit at its begin [nq+d]
  Vector x_end;             ///< left limit at its end [nq+d]
  ConstraintSet activated;  ///< what touches down at its end, …
  ConstraintSet released;   ///< … and what lets go
  /// Times of the table [N]; those at which the input changes, of knots, and t_begin and t_end,
  /// occur twice.
  std::vector<double> t;
  Matrix x;  ///< states at these [nq+d × N]
  Matrix a;  ///< and v̇; of two at the same time the left limit, then the right one [d × N]
};

/// A run that is to be followed, each phase of which goes on beyond the events at its ends: forward
/// and backward in its own contact mode, under the inputs of the time, whether gaps or forces would
/// allow it. A robot whose touchdown comes early or late is compared with the phase that it is in,
/// and its error does not jump. It is a value, which knows of no system.
class ExtendedReference {
 public:
  /// Of a trajectory made with SimulateOptions::dense under these inputs; each phase goes on by at
  /// most `reach` [s] at either end, less where its motion ends before. Throws
  /// std::invalid_argument for a run that ended early and a reach that is not finite or below 0.
  ExtendedReference(const MechanicalSystem& system, const Trajectory& run, InputSchedule inputs,
                    double reach);
  /// Of phases that were made before, as CheckPolicy wants them.
  ExtendedReference(ConfigurationSpace space, InputSchedule inputs,
                    std::vector<ReferencePhase> phases, ConstraintSet instants = {});

  const std::vector<ReferencePhase>& phases() const { return phases_; }  ///< in their order
  /// Index of the phase at t, the earlier one at an event.
  int PhaseAt(double t) const;
  /// x of a phase at t [nq+d], cubic between the times of its table; beyond the table what is there
  /// at its end.
  Vector State(int phase, double t) const;
  /// x ⊟ State(phase, t) [2d].
  Vector Error(int phase, double t, const VectorRef& x) const;
  /// The input at t, which holds from there on [m].
  const Vector& Input(double t) const;
  const ConfigurationSpace& space() const { return space_; }  ///< of its states
  const InputSchedule& inputs() const { return inputs_; }     ///< its inputs
  /// Constraints of time alone, DrivenSwitches, which are no contacts.
  ConstraintSet instants() const { return instants_; }

 private:
  ConfigurationSpace space_;
  InputSchedule inputs_;
  std::vector<ReferencePhase> phases_;
  ConstraintSet instants_;
};

}  // namespace contact_flow
