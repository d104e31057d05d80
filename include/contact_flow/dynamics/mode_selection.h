// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <stdexcept>

#include "contact_flow/contact_mode.h"
#include "contact_flow/dynamics/contact_dynamics.h"
#include "contact_flow/types.h"

namespace contact_flow {

/// No contact mode, or more than one, fits a state: the motion would slide on a switching surface,
/// or is not unique (Filippov).
struct UndecidedMode : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The contact mode of a state among the rigid candidates C = {i : a_i = 0, Da_i v = 0} (Sec. 2),
/// beside the `pressed` compliant ones: the support of
///   0 ≤ λ ⟂ ä = Da v̇ + Ḋa v ≥ 0,
/// together with `pressed`. A constraint whose force vanishes there, or does so within
/// `time_tolerance` [s] at its present rate, belongs to the mode exactly when its force would grow:
/// dλ_i/dt > 0 in the mode with it. Where the effort depends on the mode, the one J ⊂ C with λ_J ≥
/// 0 and ä_{C∖J} ≥ 0 in its own field is looked for; throws UndecidedMode when none or several fit.
ContactMode SelectContactMode(ContactDynamics* dynamics, const VectorRef& x, ContactMode candidates,
                              double time_tolerance, ContactMode pressed = ContactMode());

}  // namespace contact_flow
