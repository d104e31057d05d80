// SPDX-License-Identifier: BSD-3-Clause
#include "warnings.h"

#include <cmath>

namespace contact_flow {
namespace ros_interface {

static_assert(ResultWarning::GRAZING == static_cast<int>(Outcome::kGrazing) &&
                  ResultWarning::ZENO == static_cast<int>(Outcome::kZeno) &&
                  ResultWarning::DISCONTINUOUS == static_cast<int>(Outcome::kDiscontinuous) &&
                  ResultWarning::NOT_DIFFERENTIABLE ==
                      static_cast<int>(Outcome::kNotDifferentiable) &&
                  ResultWarning::TOO_MANY_PIECES == static_cast<int>(Outcome::kTooManyPieces) &&
                  ResultWarning::FILIPPOV == static_cast<int>(Outcome::kFilippov),
              "the first constants of the message are outcomes");

ResultWarning MakeWarning(std::uint8_t code, const std::string& message, double t) {
  ResultWarning m;
  m.code = code;
  m.t = std::isnan(t) ? -1 : t;  // so that equal warnings compare equal
  m.message = message;
  return m;
}

std::vector<ResultWarning> ToMsg(const std::vector<DirectionNote>& notes) {
  std::vector<ResultWarning> messages;
  for (const DirectionNote& note : notes) {
    const bool projected = note.kind == DirectionNote::Kind::kProjected;
    messages.push_back(
        MakeWarning(projected ? ResultWarning::PROJECTED : ResultWarning::LEFT_OUT, note.message));
  }
  return messages;
}

std::vector<ResultWarning> ToMsg(const std::vector<Warning>& warnings) {
  std::vector<ResultWarning> messages;
  for (const Warning& warning : warnings) {
    messages.push_back(
        MakeWarning(static_cast<std::uint8_t>(warning.code), warning.message, warning.t));
  }
  return messages;
}

}  // namespace ros_interface
}  // namespace contact_flow
