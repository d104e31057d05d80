// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sstream>
#include <stdexcept>

#include "contact_flow/dynamics/mode_selection.h"
#include "contact_flow/flow/status.h"
#include "contact_flow/flow/trajectory.h"
#include "contact_flow/model/mechanical_system.h"

namespace contact_flow {

/// Resolves a transition at t [s]; what keeps it from being resolved becomes a status.
template <class Function>
Status Guarded(double t, const Function& resolve) {
  const auto sentence = [t](const char* separator, const std::exception& reason) {
    std::ostringstream message;
    message.precision(12);
    message << "at t = " << t << " s" << separator << reason.what();
    return message.str();
  };
  try {
    resolve();
  } catch (const UndecidedMode& reason) {
    return {Outcome::kFilippov, sentence(": ", reason)};
  } catch (const std::domain_error& reason) {
    return {Outcome::kNonFinite, sentence(" ", reason)};
  }
  return {};
}

/// Says in its obstacle that the contacts of J⁺ and those it implies are dependent, if any are.
void NoteImplied(const MechanicalSystem& system, Transition* transition);

}  // namespace contact_flow
