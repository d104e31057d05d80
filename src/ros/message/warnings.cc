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

std::vector<ResultWarning> ToMsg(const std::vector<Warning>& warnings) {
  std::vector<ResultWarning> messages;
  for (const Warning& warning : warnings) {
    messages.push_back(
        MakeWarning(static_cast<std::uint8_t>(warning.code), warning.message, warning.t));
  }
  return messages;
}

std::string Summary(const std::vector<ResultWarning>& warnings) {
  if (warnings.empty()) return "";
  if (warnings.size() == 1) return warnings.front().message;
  return warnings.front().message + "; " + std::to_string(warnings.size() - 1) +
         " more in warnings";
}

}  // namespace ros_interface
}  // namespace contact_flow
