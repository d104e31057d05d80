// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// A step that lasts no longer than this part of its arc is an instant.
inline constexpr double kInstantPart = 1e-8;

/// What an arc, or a slice of one, is to know of the run around it.
struct ArcInRun {
  double gap_tolerance = 0;       ///< of the run [m]
  double speed_tolerance = 0;     ///< of the run [m/s]
  double absolute_tolerance = 0;  ///< of the run
  double duration = 0;            ///< of the run [s]
  double instant = 0;             ///< what lasts no longer tells nothing of slopes [s]
  bool forces_decide = false;     ///< whether the arc ends where a force of a contact says so
  Matrix inputs;                  ///< as those of RestingQuestion
};

/// Whether forces of contacts decide when this transition comes: one vanishes, or reaches its cone.
bool ForcesDecide(const MechanicalSystem& system, const Transition& transition);

/// Whether an arc may be differentiated: CheckFreeSlips, CheckRestingCorners, CheckIdleContacts.
Status CheckArc(ContactDynamics* dynamics, const Arc& arc, const ArcInRun& in_run);

/// Not kOk where a contact holds without a force that would keep it: it may as well let go.
/// `push_reach` is that of VariationStatistics [n].
Status CheckPushes(const MechanicalSystem& system, const Arc& arc, const Vector& push_reach,
                   double absolute_tolerance);

/// Not kOk where a face slides in space: how its forces are shared is not unique, and it decides as
/// soon as the face turns.
Status CheckSlidingFace(ContactDynamics* dynamics, const Arc& arc, double gap_tolerance);

}  // namespace contact_flow
