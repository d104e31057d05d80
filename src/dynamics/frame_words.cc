// SPDX-License-Identifier: BSD-3-Clause
#include "frame_words.h"

#include <limits>
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

std::string TellWords(const MechanicalSystem& system, const FrictionFrame& frame,
                      const std::vector<FrictionSolution>& words, ConstraintSet contacts) {
  std::ostringstream told;
  for (const FrictionSolution& word : words) {
    if (&word != &words.front()) told << ", ";
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
    told << ")";
  }
  return told.str();
}

ContactMode ChooseWord(const FrictionFrame& frame, const std::vector<FrictionSolution>& words,
                       ConstraintSet varying, ContactMode before) {
  const FrictionSolution* least = nullptr;
  double smallest = std::numeric_limits<double>::infinity();
  for (const FrictionSolution& word : words) {
    const ContactMode mode = ModeOfWord(frame, word);
    bool same = true;
    for (int i : varying) same = same && mode.LetterOf(i) == before.LetterOf(i);
    if (same) return mode;
    const double size = word.force.dot(frame.problem().G * word.force);
    if (least != nullptr && !(size < smallest)) continue;
    least = &word;
    smallest = size;
  }
  return ModeOfWord(frame, *least);
}

}  // namespace contact_flow
