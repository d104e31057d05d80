// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "test/adversary/generator.h"

namespace contact_flow {
namespace adversary {

/// What comes of one case.
struct Verdict {
  enum class Kind { kRight, kRefused, kSkipped, kContradicted };
  Kind kind = Kind::kSkipped;
  /// Of a refusal: "outcome: class", with what the reference says of it; of a contradiction: what
  /// is wrong.
  std::string reason;
  std::string detail;  ///< numbers, and the message of a refusal
  int directions = 0;  ///< that were compared
  int undecided = 0;   ///< directions whose quotients do not settle
};

const char* Name(Verdict::Kind kind);

/// Simulates, differentiates and holds both against quotients of the reference simulator.
Verdict Judge(const Case& c);

/// How far the library's own quotient along w, at tight tolerances, is off a
/// prediction; a sentence.
std::string SecondOpinion(const Case& c, const Vector& w, const Vector& prediction, double alpha);

}  // namespace adversary
}  // namespace contact_flow
