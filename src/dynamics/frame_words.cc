// SPDX-License-Identifier: BSD-3-Clause
#include "frame_words.h"

#include <algorithm>
#include <sstream>

#include "contact_flow/dynamics/guards.h"
#include "row_units.h"

namespace contact_flow {
namespace {

/// A motion that differs from that of the letters until now by less than this is theirs, relative.
constexpr double kSameAsBefore = 1e-6;

}  // namespace

ContactMode ModeOfWord(const FrictionFrame& frame, const FrictionSolution& word) {
  ContactMode mode;
  for (std::size_t k = 0; k < frame.constraints().size(); ++k) {
    const Letter letter = word.letters[k];
    const bool free = letter != Letter::kOpen && frame.problem().contacts[k].dimension == 0;
    mode.Set(frame.constraints()[k], free ? Letter::kSlip : letter);
  }
  return mode;
}

void SetSlips(const TouchingContacts& touching, const VectorRef& v, FrictionFrame* frame) {
  FrictionProblem& problem = frame->problem();
  for (std::size_t k = 0; k < problem.contacts.size(); ++k) {
    FrictionContact& contact = problem.contacts[k];
    const int i = frame->constraints()[k];
    contact.slips = touching.slipping.Contains(i) && contact.dimension > 0;
    if (!contact.slips) continue;
    if (contact.dimension == 2) {
      contact.direction = (frame->rows().middleRows<2>(problem.Row(k) + 1) * v).normalized();
    } else {
      contact.direction(0) = SlipSign(touching.slipping.LetterOf(i));
    }
  }
}

std::string TellWords(const MechanicalSystem& system, const FrictionFrame& frame,
                      const std::vector<FrictionSolution>& words, const ConstraintSet& contacts) {
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

std::optional<ContactMode> KeptWord(const FrictionFrame& frame,
                                    const std::vector<FrictionSolution>& all,
                                    const std::vector<FrictionSolution>& words,
                                    const ConstraintSet& varying, const ContactMode& before) {
  const auto same = [&](const FrictionSolution& word) {
    const ContactMode mode = ModeOfWord(frame, word);
    for (int i : varying) {
      if (mode.LetterOf(i) != before.LetterOf(i)) return false;
    }
    return true;
  };
  const auto kept = std::find_if(words.begin(), words.end(), same);
  if (kept != words.end()) return ModeOfWord(frame, *kept);
  // Forces of the letters until now vanish here: what they leave is their motion.
  const auto until_now = std::find_if(all.begin(), all.end(), same);
  if (until_now == all.end() || words.empty()) return std::nullopt;
  const RowUnits units(frame.problem());
  const auto apart = [&](const FrictionSolution& word) {
    return units.Largest(word.result - until_now->result);
  };
  const auto nearest =
      std::min_element(words.begin(), words.end(),
                       [&](const auto& a, const auto& b) { return apart(a) < apart(b); });
  const double scale = units.Largest(frame.problem().b);
  if (!(apart(*nearest) <= kSameAsBefore * scale)) return std::nullopt;
  return ModeOfWord(frame, *nearest);
}

bool AllSlip(const FrictionFrame& frame) {
  const std::vector<FrictionContact>& all = frame.problem().contacts;
  return std::all_of(all.begin(), all.end(),
                     [](const auto& contact) { return contact.slips || contact.dimension == 0; });
}

ContactMode ChooseWord(const FrictionFrame& frame, const std::vector<FrictionSolution>& all,
                       const std::vector<FrictionSolution>& words, const ConstraintSet& varying,
                       const ContactMode& before) {
  const auto kept = KeptWord(frame, all, words, varying, before);
  if (kept) return *kept;
  const auto size = [&](const FrictionSolution& word) {
    return word.force.dot(frame.problem().G * word.force);
  };
  return ModeOfWord(
      frame, *std::min_element(words.begin(), words.end(),
                               [&](const auto& a, const auto& b) { return size(a) < size(b); }));
}

}  // namespace contact_flow
