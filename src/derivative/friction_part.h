// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/flow/trajectory.h"

namespace contact_flow {

/// The contacts that have friction, also one that is 0 for now.
ConstraintSet ContactsWithFriction(const MechanicalSystem& system);

/// Whether friction has a part in the events of a transition: whether a contact with friction is
/// met, lets go, begins or ceases to slip, or is in contact and has coordinates in common, directly
/// or through the mass and other contacts, with what is. Where it has none, contacts with friction
/// go on aside, with their letters, and the events are those of a system without.
bool FrictionTakesPart(ContactDynamics* dynamics, const Transition& transition);

}  // namespace contact_flow
