// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "contact_flow/dynamics/word_selection.h"

namespace contact_flow {

/// The letters of a solution as a contact mode of the system.
ContactMode ModeOfWord(const FrictionFrame& frame, const FrictionSolution& word);

/// Tells the contacts of the frame that slip, and their directions at the velocity v.
void SetSlips(const TouchingContacts& touching, const VectorRef& v, FrictionFrame* frame);

/// The words of accelerations, and for some contacts how they rise, or with what they press:
/// motions that could go on.
std::string TellWords(const MechanicalSystem& system, const FrictionFrame& frame,
                      const std::vector<FrictionSolution>& words, const ConstraintSet& contacts);

/// Of words of several motions, all those that fit, and among them those that go on, the one in
/// which the contacts of `varying` have the letters of `before`, or else the one that has their
/// motion at this instant.
std::optional<ContactMode> KeptWord(const FrictionFrame& frame,
                                    const std::vector<FrictionSolution>& all,
                                    const std::vector<FrictionSolution>& words,
                                    const ConstraintSet& varying, const ContactMode& before);

/// Whether nothing sticks in any word: then all of them are tried.
bool AllSlip(const FrictionFrame& frame);

/// This one, or else that of the smallest forces.
ContactMode ChooseWord(const FrictionFrame& frame, const std::vector<FrictionSolution>& all,
                       const std::vector<FrictionSolution>& words, const ConstraintSet& varying,
                       const ContactMode& before);

}  // namespace contact_flow
