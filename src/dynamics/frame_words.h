// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// The letters of a solution as a contact mode of the system.
ContactMode ModeOfWord(const FrictionFrame& frame, const FrictionSolution& word);

/// The word of accelerations, and for some contacts how they rise, or with what they press: a
/// motion that could go on.
std::string TellWord(const MechanicalSystem& system, const FrictionFrame& frame,
                     const FrictionSolution& word, ContactMode contacts);

}  // namespace contact_flow
