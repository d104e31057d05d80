// SPDX-License-Identifier: BSD-3-Clause
#include "frame_words.h"

#include <sstream>

namespace contact_flow {

ContactMode ModeOfWord(const FrictionFrame& frame, const FrictionSolution& word) {
  ContactMode mode;
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    const Letter letter = word.letters[k];
    const bool free = letter != Letter::kOpen && frame.problem().contacts[k].dimension == 0;
    mode.Set(frame.constraints()[k], free ? Letter::kSlip : letter);
  }
  return mode;
}

std::string TellWord(const MechanicalSystem& system, const FrictionFrame& frame,
                     const FrictionSolution& word, ContactMode contacts) {
  std::ostringstream told;
  told << "'" << ModeOfWord(frame, word).Word(system.num_constraints()) << "' (";
  const char* separator = "";
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    const int i = frame.constraints()[k], row = frame.problem().Row(k);
    if (!contacts.Contains(i)) continue;
    told << separator << system.description().constraints[i];
    separator = ", ";
    if (word.letters[k] == Letter::kOpen) {
      told << " rises at " << word.result(row) << " m/s^2";
    } else {
      told << " presses with " << word.force(row) << " N";
    }
  }
  return told.str() + ")";
}

}  // namespace contact_flow
