// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

/// What there is to note of a result that came out, as sentences in its message.
namespace contact_flow {

/// Appends a sentence to a message.
inline void AddNote(const std::string& note, std::string* message) {
  if (!note.empty()) *message += (message->empty() ? "" : "; ") + note;
}

/// The first sentence, and how many more there are in the result's `warnings`.
template <class Warnings>
std::string SummaryOf(const Warnings& warnings) {
  if (warnings.empty()) return "";
  if (warnings.size() == 1) return warnings.front().message;
  return warnings.front().message + "; " + std::to_string(warnings.size() - 1) +
         " more in warnings";
}

}  // namespace contact_flow
